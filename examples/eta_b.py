"""How stiff is my fabric?  eta_b from the height of a fold, and from a picture of one (needs stripfold[vision])."""

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

import stripfold as sf
from stripfold import elastica

# Fold a strip in half without pressing the fold; measure the largest height of its loop.
found = sf.eta_b(fold_height=0.027)
print(found)
strip = sf.Strip(length=0.6, eta_b=found.eta_b)
print(f"lambda_c at 9 cm: {strip.critical(height=0.09, model='rod').lambda_c:.4f} m\n")

# A photograph of the same says how well it is known.  Here one is drawn: the loop of a strip with L* = 30 mm, seen
# from the side at 0.1 mm per pixel.
scale, unit = 1e-4, 0.03
loop = elastica.folded_loop()
shape = loop.state.at(np.linspace(0.0, loop.state.length, 400))
x = np.concatenate([[-3.0], shape.x, [loop.offset - 3.0]]) * unit / scale
z = np.concatenate([[0.0], shape.z, [0.0]]) * unit / scale
x, z = x - x.min() + 150, z + 12.0
picture = Image.new("L", (int(x.max()) + 150, 500), 40)
drawing = ImageDraw.Draw(picture)
drawing.line([(float(a), float(480 - b)) for a, b in zip(x, z, strict=True)], fill=220, width=11, joint="curve")
picture.filter(ImageFilter.GaussianBlur(1.0)).save("fold.png")

measured = sf.eta_b(image="fold.png", scale=scale, method="fold")
print(measured)
# A strip of thickness t gives an eta_b that is 0.38 t / L* too low: here 1.1 mm of line, 30 mm of L*.
print(f"drawn with eta_b = {1.0 / (9.81 * unit**3):.0f} m^-4 s^2")
measured.plot().savefig("eta_b.png", dpi=200)
