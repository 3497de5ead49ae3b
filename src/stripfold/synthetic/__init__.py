"""Synthetic recordings: a computed motion seen by a camera model, with calibration, robot log and known truth.

They test the measurement of lambda.  Title, files and every picture of a recording say that it is synthetic.
"""

from stripfold.base.errors import require

require("vision")
