"""The suite runs with the transforms that everybody has; test_transforms.py compares those of ducc0 with them."""

import os

os.environ["ROUGHVISC_TRANSFORMS"] = "scipy"
