"""Colours with their meanings."""

# The palette of Okabe and Ito, safe for colour-blind readers, and three colours of the paper.
BLUE, VERMILLION, GREEN, PINK = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, BLACK, GREY = "#E69F00", "#56B4E9", "#000000", "#8C8C8C"
RED, PURPLE, MAGENTA = "#D40000", "#882288", "#C800A1"

# One meaning each, as in the paper, which itself uses red, blue and green twice: red for the mid-surface and for the
# strip in motion, blue for points that stay in place and for one way out of an R-path, green for states after a fall
# and for lines at lambda_0 and lambda_c.  Other colours tell the entries of one legend apart.
GRIPPER = PURPLE
FIXED = BLUE
MID_SURFACE = RED
STATIC, CRITICAL, UNSTABLE, FALLING, SETTLED = "0.62", BLACK, VERMILLION, RED, GREEN
LEVEL = GREEN
TOUCHING, HANGING = RED, BLUE
FRICTION = ORANGE
LYING = MAGENTA
STRIP, SHADE = "#DDDDDD", "#EEEEEE"
