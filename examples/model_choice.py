"""Which model, at which accuracy?  The same critical point by the solid, the rod and the elastica."""

import stripfold as sf

strip = sf.Strip(length=0.6, eta_b=3780)
height = 0.09

# The paper's model is the solid.  The rod and the elastica are faster; how far their lambda_c is from the solid's is
# estimated and reported as model_error.
print(f"{'model':<10}{'accuracy':<10}{'lambda_c [mm]':<16}{'error [mm]':<12}{'model_error [mm]':<18}time [s]")
for model in ("elastica", "rod", "solid"):
    for accuracy in (1e-2, 1e-3):
        point = strip.critical(height, model=model, accuracy=accuracy)
        print(
            f"{model:<10}{accuracy:<10g}{1e3 * point.lambda_c:<16.3f}{1e3 * point.error:<12.1e}"
            f"{1e3 * point.model_error:<18.1e}{point.seconds:.2f}"
        )

# "auto" takes the cheapest model whose model_error leaves room for the accuracy.
for accuracy in (1e-1, 1e-2, 1e-3):
    point = strip.critical(height, model="auto", accuracy=accuracy)
    print(f"auto, accuracy {accuracy:g}: {point.model}, lambda_c = {1e3 * point.lambda_c:.3f} mm")

# A request that no model can meet, or that makes no sense, is an error that says what is allowed.
try:
    strip.critical(height, accuracy=1.0)
except sf.InvalidInputError as error:
    print(error)
