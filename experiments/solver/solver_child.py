"""The solver of one git revision as a program that runs one simulation per line of input, for `solver_processes`.

It imports the `bem` of that revision, which is first on the path of its process, and therefore uses only the part of
the public interface that all revisions share. Each line of input is a JSON object: `tabor`, `modulus_ratio` (1 is
elastic), `protocol` (the arguments of `LoadingProtocol`), `accuracy`, the instants `times`, and `adhesion`, which is 0
without adhesion and may be absent. Each line of output is a JSON object too:
`seconds` (processor seconds of the simulation), `status`, `work` (the statistics that this revision has) and, if it
completed, `results`.
"""

import json
import sys
import time

import bem


def answer(asked: dict) -> dict:
    """Simulate once; an exception of the solver becomes the status."""
    started = time.process_time()
    try:
        scene = scene_of(asked)
        protocol = bem.LoadingProtocol(**asked["protocol"])
        started = time.process_time()
        trajectory = bem.simulate(scene, protocol, asked["accuracy"])
        seconds = time.process_time() - started
    except Exception as error:  # one failing case must not end the comparison
        return {"seconds": time.process_time() - started, "status": f"{type(error).__name__}: {error}", "work": {}}
    found = {
        "seconds": seconds,
        "status": trajectory.status,
        "work": {name: value for name, value in vars(trajectory.stats).items() if isinstance(value, int | float)},
    }
    if trajectory.completed:
        found["results"] = [trajectory.pull_off_force, trajectory.hysteresis]
        found["results"] += trajectory.at([min(instant, trajectory.time[-1]) for instant in asked["times"]]).tolist()
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
