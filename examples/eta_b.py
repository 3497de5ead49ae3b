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

# A photograph of the same says how well it is known.  Here one is drawn: the loop of a strip with L* = 30 mm that is
# 1.2 mm thick, seen from the side at 0.1 mm per pixel.
scale, unit, thickness = 1e-4, 0.03, 0.0012
loop = elastica.folded_loop(thickness / unit)
shape = loop.state.at(np.linspace(0.0, loop.state.length, 400))
x = np.concatenate([[-3.5], shape.x, [-3.0]]) * unit / scale
z = np.concatenate([[0.0], shape.z, shape.z[-1:]]) * unit / scale
x, z = x - x.min() + 150, z + 12.0
picture = Image.new("L", (int(x.max()) + 150, 500), 40)
drawing = ImageDraw.Draw(picture)
drawing.line([(float(a), float(480 - b)) for a, b in zip(x, z, strict=True)], fill=220, width=12, joint="curve")
picture.filter(ImageFilter.GaussianBlur(1.0)).save("fold.png")

measured = sf.eta_b(image="fold.png", scale=scale, method="fold")
print(measured)
print(f"drawn with eta_b = {1.0 / (9.81 * unit**3):.0f} m^-4 s^2")
measured.plot().savefig("eta_b.png", dpi=200)
