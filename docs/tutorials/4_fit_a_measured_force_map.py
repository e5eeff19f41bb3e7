"""
# Fit a force map

From a file of many curves to a table and a picture: three places on the spinal cord of a zebrafish.

The file was measured for Moellmert et al. (Biophys. J. 118, 2020, 448) and is published with the package afmformats
under the MIT licence, whose text is `examples/measured_tissue.LICENSE` of the repository.
"""

# %%
# ## The file
#
# A bead of 37.28 um was pressed into tissue at three places. On the command line, the same is
# `bem fit-map tissue.jpk-force-map --radius 18.64um --model hertz --segment approach --out map.csv --plot map.png`.

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np

import bem
from bem.lab.maps import fit_map, read_map
from bem.lab.units import readable

file = Path(bem.__file__).parents[1] / "examples" / "tissue.jpk-force-map"
out = Path(mkdtemp()) / "map.csv"
rows = fit_map([file], out, radius="18.64 um", model="hertz", segment="approach")
print(*out.read_text().splitlines()[1:2], sep="\n")

# %%
# ## One line a curve
#
# A line holds model, values, intervals and position. Where no model is adequate, the interval of the modulus is its
# spread over windows of depth. A curve that cannot be fitted has a reason in place of numbers. The file is written line
# by line: the same call goes on after an interruption.

for row in read_map(out):
    low, high = (
        readable(row[f"relaxed_modulus_{end}"], "Pa") for end in ("low", "high")
    )
    modulus = readable(row["relaxed_modulus"], "Pa")
    words = f"{row['model']}, adequate: {row['adequate']}"
    print(f"curve {row['number']}: {words}, misfit {row['misfit']:.1f}")
    print(f"         {modulus}, between {low} and {high}", row["reason"])

# %%
# ## What the map says
#
# The moduli of the three places differ by more than an order of magnitude, and each runs over its windows of depth: the
# surface of the tissue is not a half-space with a sharp boundary. The spread says how far one number describes a place.

places = 1e6 * np.array([(row["x"], row["y"]) for row in rows])
moduli = np.array([row["relaxed_modulus"] for row in rows])
figure, axes = plt.subplots(figsize=(5.0, 4.0), layout="constrained")
drawn = axes.scatter(*places.T, c=moduli, norm="log", s=400, marker="s")
axes.margins(0.2)
axes.set(xlabel="x (µm)", ylabel="y (µm)")
figure.colorbar(drawn, label="relaxed modulus (Pa)")
plt.show()
