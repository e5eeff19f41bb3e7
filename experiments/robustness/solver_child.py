"""The solver of one git revision as a program that runs one simulation per line of input, for `bench_solver`.

It imports the `bem` of that revision, which is first on the path of its process, and uses only what all revisions
share. A line of input is a JSON object: `tabor`, `modulus_ratio` (1 is elastic), the arguments of `LoadingProtocol`,
`accuracy`, the instants `times`, and perhaps `adhesion`, 0 for none. A line of output is another: `seconds` (processor
seconds of the simulation), `status` and, if it completed, `results`.
"""

import json
import sys
import time

import bem

PROTOCOL = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")


def answer(asked: dict) -> dict:
    """Simulate once; an exception of the solver becomes the status."""
    started = time.process_time()
    try:
        scene, protocol = scene_of(asked), bem.LoadingProtocol(**{name: asked[name] for name in PROTOCOL})
        started = time.process_time()
        trajectory = bem.simulate(scene, protocol, asked["accuracy"])
        found = {"seconds": time.process_time() - started, "status": trajectory.status}
    except Exception as error:  # one failing case must not end the comparison
        return {"seconds": time.process_time() - started, "status": f"{type(error).__name__}: {error}"}
    if trajectory.completed:
        force = trajectory.at([min(instant, trajectory.time[-1]) for instant in asked["times"]])
        found["results"] = [trajectory.pull_off_force, trajectory.hysteresis, *force.tolist()]
    return found


def scene_of(asked: dict) -> bem.Scene:
    """The scene of a request."""
    ratio = asked["modulus_ratio"]
    material = bem.StandardLinearSolid(ratio) if ratio < 1.0 else bem.Elastic()
    return bem.Scene(asked["tabor"], material, *([] if asked.get("adhesion", 1.0) else [bem.HardContact()]))


if __name__ == "__main__":
    answers, sys.stdout = sys.stdout, sys.stderr  # output of the solver must not mix with the answers
    print(bem.__file__, file=answers, flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), file=answers, flush=True)
