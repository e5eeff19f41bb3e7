"""Instruments' files: what of them is read, fitted and refused, and what nanite says of the same curves.

The files are those that ship with the source distributions of nanite and afmformats, unpacked into a folder. nanite is
installed in an environment of its own, whose Python is given; it fits a parabolic indenter of the same radius to the
approach. `fit` climbs its ladder, and fits Hertz to the approach for the comparison.
"""

import json
import subprocess
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.wording import markdown_table
from bem.lab import ForceCurve, fit
from bem.lab.fitting import FitError, guess_setup
from bem.lab.reading import load_afm
from bem.lab.units import readable
from experiments.measurements.harness import CLOCK, progress

RADIUS = 5e-6
FEW = 2
"""Curves of a file that are fitted."""
NANITE = """
import json, sys, time, nanite
found = []
for curve in nanite.load_group(sys.argv[1])[:int(sys.argv[2])]:
    begin = time.process_time()
    try:
        curve.apply_preprocessing(["compute_tip_position", "correct_force_offset", "correct_tip_offset"])
        model = nanite.model.get_init_parms("hertz_para")
        model["R"].value = float(sys.argv[3])
        curve.fit_model(model_key="hertz_para", params_initial=model, weight_cp=5e-7)
        fitted = curve.fit_properties
        answer = {"modulus": fitted["params_fitted"]["E"].value if fitted.get("success") else None}
        answer["rating"] = float(curve.rate_quality())
    except BaseException as error:
        answer = {"reason": f"{type(error).__name__}: {error}"}
    found.append(answer | {"seconds": time.process_time() - begin})
print(json.dumps(found))
"""


def curve_of(path: Path, number: int, curve: Any) -> dict[str, Any]:
    """What the fit says of one curve."""
    found: dict[str, Any] = {"file": path.name, "number": number}
    try:
        measured = ForceCurve(**curve.columns(path.name))
        setup = guess_setup(measured, radius=RADIUS)
        with CLOCK:
            best = fit(measured, setup)
        found |= {"model": best.model, "adequate": best.adequate, "misfit": best.misfit, "seconds": CLOCK.seconds}
        with CLOCK:
            hertz = fit(measured, setup, model="hertz", segment="approach")
        found |= {"hertz": hertz.values["relaxed_modulus"], "hertz_seconds": CLOCK.seconds}
    except (ValueError, FitError) as error:
        found["reason"] = str(error)
    return found


def beside(python: Path | None, path: Path) -> list[dict[str, Any]]:
    """What nanite says of the first curves of a file; nothing without it, or where it does not read the file."""
    if python is None:
        return []
    command = [str(python), "-c", NANITE, str(path), str(FEW), str(RADIUS)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    return json.loads(answer.stdout.splitlines()[-1]) if answer.returncode == 0 else []


def files_text(lab_files: Any) -> str:
    """The table of instruments' files in docs/laboratory.md."""
    rows = []
    for suffix in sorted({Path(entry["file"]).suffix for entry in lab_files["files"]}):
        files = [entry for entry in lab_files["files"] if Path(entry["file"]).suffix == suffix]
        curves = [each for entry in files for each in entry["curves"]]
        fitted = [each for each in curves if "model" in each]
        misfits = sorted(each["misfit"] for each in fitted)
        between = f"{misfits[0]:.2g} to {misfits[-1]:.2g}" if misfits else ""
        said = [each["reason"] for each in [*files, *curves] if each.get("reason")]
        # Without what belongs to one file.
        reasons = Counter(reason.partition(";")[0].partition(":")[0].partition(", or")[0] for reason in said)
        refused = "; ".join(f"{count}: {reason}" for reason, count in reasons.most_common())
        adequate = sum(each["adequate"] for each in fitted)
        rows.append(
            [f"`{suffix}`", str(len(files)), str(len(curves)), str(len(fitted)), str(adequate), between, refused]
        )
    header = ["files", "number", "curves tried", "fitted", "a model adequate", "misfit", "refused"]
    return markdown_table(header, rows, "lrrrrll")


def limits_text(lab_files: Any) -> str:
    """How many of the fitted curves a model is adequate to, and what their fits take."""
    fitted = [each for entry in lab_files["files"] for each in entry["curves"] if "model" in each]
    adequate, longest = sum(each["adequate"] for each in fitted), max(each["seconds"] for each in fitted)
    return (
        f"a model is adequate to {adequate} of {len(fitted)} curves of the files that ship with nanite and afmformats; "
        f"a fit takes up to {longest:.0f} s of processor time"
    )


def beside_text(lab_files: Any) -> str:
    """The table of docs/nanite.md."""
    rows = []
    for entry in lab_files["files"]:
        for ours, theirs in zip(entry["curves"], entry["nanite"], strict=False):
            if "hertz" not in ours or not theirs.get("modulus"):
                continue
            verdict = "adequate" if ours["adequate"] else "no model adequate"
            said = f"{ours['model']}, {verdict} ({ours['seconds']:.2g} s)"
            name = entry["file"].removeprefix("fmt-jpk-fd_")
            rating = f"{theirs.get('rating', float('nan')):.1f}"
            moduli = (readable(ours["hertz"], "Pa"), readable(theirs["modulus"], "Pa"))
            seconds = (f"{ours['hertz_seconds']:.2f}", f"{theirs['seconds']:.2f}")
            rows.append([f"{name}, {ours['number']}", *moduli, *seconds, said, rating])
    header = ["file, curve", "Hertz here", "nanite", "CPU s here", "CPU s nanite"]
    return markdown_table([*header, "the ladder says (CPU s)", "nanite's rating, of 10"], rows, "lrrrrlr")


def study(
    *,
    folder: Annotated[Path, typer.Option(help="Folder with the unpacked source distributions.")],
    python: Annotated[Path | None, typer.Option(help="Python of the environment that has nanite.")] = None,
) -> dict[str, Any]:
    """Read and fit every data file of the folder's distributions, each name once."""
    found = {path.name: path for path in sorted(folder.glob("*/tests/data/fmt-*"))}
    if not found:
        raise ValueError(f"Expected a folder of unpacked distributions with tests/data/fmt-* files. Received: {folder}")
    files = []
    for path in progress(list(found.values()), "files"):
        entry: dict[str, Any] = {"file": path.name, "curves": [], "nanite": []}
        try:
            curves = load_afm(path, None)
        except ValueError as error:
            inner = str(error).partition("(")[2].rstrip(")")
            entry["reason"] = (inner or str(error)).replace(str(path), path.name)
        else:
            entry["curves"] = [curve_of(path, number, curve) for number, curve in enumerate(curves[:FEW])]
            entry["nanite"] = beside(python, path)
        files.append(entry)
    return {"radius": RADIUS, "files": files}
