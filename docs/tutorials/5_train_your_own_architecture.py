"""
# Train your own architecture

Simulate a small data set, write a Keras model in a file of your own, train it, and compare its prediction with the
solver. This needs the extra `train`. The data set and the training are far smaller than the published ones, so that the
tutorial is short; the errors are accordingly larger.
"""

# %%
# ## A data set
#
# The command `bem campaign` simulates the protocols of a design, on all cores unless `--workers` says otherwise. 400
# trajectories take seconds.

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

folder = Path(tempfile.mkdtemp())


def run(command):
    """Run a command of this package in the folder, and show its last lines."""
    program, *words = command.split()
    path = os.pathsep.join(path for path in sys.path if path)
    done = subprocess.run(
        [sys.executable, "-m", program, *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path, "TF_CPP_MIN_LOG_LEVEL": "3"},
        capture_output=True,
        text=True,
        check=False,
    )
    printed = done.stdout if done.returncode == 0 else done.stderr
    print(*printed.splitlines()[-4:], sep="\n")
    done.check_returncode()


run(
    "bem campaign --design sobol --count 400 --accuracy draft "
    "--out small.h5 --workers 1"
)

# %%
# ## An architecture
#
# A function returns a Keras model of two inputs: the sequence, of shape (batch, steps, channels), and the Tabor
# parameter, of shape (batch, 1). `surrogate.register` gives it the name of a family.

architecture = '''
import keras
from keras import layers

import surrogate
from surrogate.architectures.common import inputs, readout
from surrogate.architectures.layers import AppendTabor


def convolutions(conditioning, features, name):
    """Causal convolutions of growing dilation that read the Tabor parameter."""
    sequence, tabor = inputs(features)
    hidden = AppendTabor(name="append_tabor")(sequence, tabor)
    for dilation in (1, 2, 4, 8, 16, 32):
        hidden = layers.Conv1D(
            32,
            3,
            padding="causal",
            dilation_rate=dilation,
            activation="relu",
            name=f"dilation_{dilation}",
        )(hidden)
    return keras.Model([sequence, tabor], readout(hidden), name=name)


surrogate.register("M7", convolutions, conditionings=["concat"])
'''
print((folder / "my_model.py").write_text(architecture), "characters written")

# %%
# ## Train it
#
# A recipe states optimizer, rate, batch and epochs. The same command continues a training that was interrupted.

(folder / "quick.toml").write_text("""
name = "quick"
seed = 0
batch_size = 16
epochs = 40
learning_rate = 4e-3
optimizer = "soap"
gradient_norm = 1.0
weight_average = 0.1

[cosine]
warmup_epochs = 1
""")
run(
    "surrogate train M7-concat --architecture my_model.py --recipe quick.toml "
    "--dataset small.h5 --runs runs --models models --threads 1"
)

# %%
# ## Use it
#
# A trained model predicts without Keras: training also wrote an ONNX file.

import surrogate
from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.results.plots import COLOURS

model = surrogate.load(folder / "models" / "M7-concat")
protocol = LoadingProtocol(
    peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0
)
scene = Scene(tabor=1.0, material=StandardLinearSolid(modulus_ratio=0.1))
predicted, exact = model.predict(scene, protocol), simulate(scene, protocol)

figure, axes = plt.subplots(figsize=(6.0, 3.8), layout="constrained")
axes.plot(exact.time, exact.force, color=COLOURS["solver"], label="solver")
axes.plot(predicted.time, predicted.force, "C6--", label="M7-concat, 400 trajectories")
published = surrogate.load("M1-concat").predict(scene, protocol)
look = {"color": COLOURS["M1"], "linestyle": ":"}
axes.plot(published.time, published.force, **look, label="M1-concat, as published")
axes.set(xlabel="time (retardation times)", ylabel=r"force ($\pi R\Delta\gamma$)")
axes.legend(frameon=False)
plt.show()

# %%
# The error of each, over the range of the force:

for name, found in (("M7-concat", predicted), ("M1-concat", published)):
    error = found.force - exact.at(found.time)
    print(f"{name}: {100 * np.sqrt(np.mean(error**2)) / np.ptp(exact.force):.2f} %")
