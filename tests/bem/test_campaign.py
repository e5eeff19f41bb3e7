import errno
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import h5py
import numpy as np
import pytest
import typer
from joblib.externals.loky import get_reusable_executor
from typer.testing import CliRunner

import bem.dataset_file
import bem.parts
from bem.campaign import batches_of, expected_cost, run_campaign
from bem.campaign_cli import register
from bem.campaign_files import merge, verify
from bem.campaign_plan import Campaign
from bem.campaign_progress import rate_line
from bem.dataset_file import load_dataset, open_dataset, read_tree
from bem.designs import Design
from bem.measurement import measurement_grid
from bem.parts import CampaignError
from bem.pools import Cluster
from surrogate.dataset import TrajectoryDataset

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import campaign_stand_in as stand_in  # noqa: E402

TIMINGS = ("scalars/solver_seconds",)
app = typer.Typer()
register(app)


def command(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def numbers(path):
    with open_dataset(path) as file:
        return {name: values for name, values in read_tree(file).items() if name not in TIMINGS}


def assert_same_numbers(path, other):
    found, expected = numbers(path), numbers(other)
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)


@pytest.fixture(scope="module")
def plan():
    return Campaign(count=120, seed=4, native=True)


@pytest.fixture(scope="module")
def undisturbed(plan, tmp_path_factory):
    path = tmp_path_factory.mktemp("undisturbed") / "data.h5"
    summary = run_campaign(plan, path, solver=stand_in.solve, command="bem campaign --count 120")
    assert (summary.count, summary.computed, summary.failures) == (120, 120, Counter())
    assert sorted(path.parent.iterdir()) == [path]
    return path


@pytest.fixture(scope="module")
def undisturbed_slow(plan, tmp_path_factory):
    path = tmp_path_factory.mktemp("undisturbed") / "data.h5"
    run_campaign(plan, path, solver=stand_in.slow)
    return path


def test_file_holds_what_its_documentation_says(plan, undisturbed):
    dataset = load_dataset(undisturbed)
    assert len(dataset) == 120
    assert dataset.force.shape == (120, 120)
    assert dataset.force.dtype == np.float32
    assert dataset.counts == (50, 20, 50)
    for name, values in plan.protocols.items():
        np.testing.assert_array_equal(dataset.protocols[name], values)
    for name in ("pull_off_force", "pull_off_time", "hysteresis", "max_compression", "end_force", "solver_seconds"):
        assert dataset.scalars[name].dtype == np.float64
    attributes = dataset.attributes
    assert (attributes["design"], attributes["seed"], attributes["accuracy"]) == ("paper", 4, "standard")
    assert attributes["ranges"]["tabor"] == [0.2, 3.2]
    assert attributes["command"] == "bem campaign --count 120"
    assert {"python", "numpy", "scipy", "numba"} <= attributes["versions"].keys()
    assert attributes["host"]
    assert attributes["git_revision"]
    assert 0.0 < attributes["core_seconds"] < 60.0
    jumps = dataset.columns["jumps/trajectory"]
    np.testing.assert_array_equal(np.unique(jumps), np.flatnonzero(plan.protocols["tabor"] > 1.0))
    np.testing.assert_array_equal(dataset.scalars["jump_count"], np.bincount(jumps, minlength=120))


def test_native_history_is_the_solvers_own(plan, undisturbed):
    times, _ = measurement_grid(**plan.protocols)
    with open_dataset(undisturbed) as file:
        offsets = file["native/offsets"][:]
        for row in (0, 57, 119):
            piece = slice(offsets[row], offsets[row + 1])
            time_, force = file["native/time"][piece], file["native/force"][piece]
            assert len(time_) >= 40
            assert force.max() == file["scalars/pull_off_force"][row]
            np.testing.assert_allclose(
                np.interp(times[row], time_, force), file["fms/force"][row], rtol=1e-6, atol=1e-6
            )


def test_the_surrogates_reader_reads_it(undisturbed):
    dataset = TrajectoryDataset.load(undisturbed)
    assert len(dataset.completed) == 120
    assert dataset.counts == (50, 20, 50)


def test_numbers_do_not_depend_on_the_number_of_workers(plan, undisturbed, tmp_path):
    run_campaign(plan, tmp_path / "one.h5", solver=stand_in.solve, workers=1)
    assert_same_numbers(tmp_path / "one.h5", undisturbed)


def test_failures_are_recorded_with_their_reason(tmp_path):
    plan = Campaign(count=200, seed=1)
    summary = run_campaign(plan, tmp_path / "data.h5", solver=stand_in.sometimes_fails)
    tabor = plan.protocols["tabor"]
    assert summary.failures == Counter(
        {
            "ArithmeticError: tabor is too large for me": int(np.sum(tabor > 3.0)),
            "no stable equilibrium found": int(np.sum(tabor < 0.25)),
        }
    )
    dataset = load_dataset(tmp_path / "data.h5")
    np.testing.assert_array_equal(dataset.completed, np.flatnonzero((tabor <= 3.0) & (tabor >= 0.25)))
    lost = dataset.columns["status"] == 1
    assert np.isnan(dataset.force[lost]).all()
    assert np.isnan(dataset.scalars["pull_off_force"][lost]).all()
    np.testing.assert_array_equal(dataset.protocols["tabor"], tabor)


def start_campaign(out, solver="slow", count=120):
    code = (
        f"import sys; sys.path.insert(0, {str(HERE)!r})\n"
        "import bem.parts, campaign_stand_in\n"
        "from pathlib import Path\n"
        "from bem.campaign import run_campaign\n"
        "from bem.campaign_plan import Campaign\n"
        "bem.parts.SECONDS_BETWEEN_PARTS = 0.05\n"
        f"plan = Campaign(count={count}, seed=4, native=True)\n"
        f"run_campaign(plan, Path({str(out)!r}), workers=2, solver=campaign_stand_in.{solver})\n"
    )
    return subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, cwd=HERE.parents[1])


def children(parent):
    if shutil.which("ps") is None:
        return []
    answer = subprocess.run(["ps", "-o", "pid=", "--ppid", str(parent)], capture_output=True, text=True)
    return answer.stdout.split()


def parts(out):
    return list(out.with_name(out.name + ".parts").glob("part-*.h5"))


def await_parts(out, process, at_least):
    limit = time.monotonic() + 60.0
    while len(parts(out)) < at_least and process.poll() is None:
        assert time.monotonic() < limit
        time.sleep(0.005)


def test_kill_at_random_moments_loses_and_duplicates_nothing(plan, undisturbed_slow, tmp_path):
    out = tmp_path / "data.h5"
    chance = random.Random(0)
    kept = 0
    for _ in range(2):
        process = start_campaign(out)
        await_parts(out, process, len(parts(out)) + 1)
        time.sleep(chance.uniform(0.0, 0.2))
        workers = children(process.pid)
        process.kill()
        process.wait()
        process.stderr.close()
        assert not out.exists() or len(load_dataset(out)) == 120
        assert len(parts(out)) >= kept
        kept = len(parts(out))
    summary = run_campaign(plan, out, solver=stand_in.slow)
    assert summary.computed < 120
    assert_same_numbers(out, undisturbed_slow)
    assert sorted(tmp_path.iterdir()) == [out]
    limit = time.monotonic() + 10.0
    while alive := [worker for worker in workers if Path(f"/proc/{worker}").exists()]:
        assert time.monotonic() < limit, alive
        time.sleep(0.1)


def start_command(*arguments, solver="slow", before=""):
    code = (
        f"import sys; sys.path.insert(0, {str(HERE)!r})\n"
        "import bem.campaign, bem.parts, campaign_stand_in, functools, typer, bem.campaign_cli\n"
        f"solver = campaign_stand_in.{solver}\n"
        "bem.campaign.run_campaign = functools.partial(bem.campaign.run_campaign, solver=solver)\n"
        "app = typer.Typer()\n"
        "bem.campaign_cli.register(app)\n"
        f"sys.argv = {['bem', *map(str, arguments)]!r}\n"
        f"{before}\n"
        "app()\n"
    )
    return subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, cwd=HERE.parents[1], text=True)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_campaign_saves_what_it_holds(how, tmp_path):
    out = tmp_path / "data.h5"
    process = start_command("campaign", "--count", 3000, "--workers", 2, "--out", out)
    await_parts(out, process, 1)
    before = len(parts(out))
    process.send_signal(how)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert errors == "bem: interrupted; what was done is saved, and the same command continues\n"
    assert len(parts(out)) >= before
    assert not out.exists()


@pytest.mark.parametrize("limit", [10_000, 150_000])
def test_real_write_errors_end_in_one_sentence(limit, tmp_path):
    # The least part is larger than the first limit, the file than the second.
    before = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))"
    before += "; bem.parts.SECONDS_BETWEEN_PARTS = 0.0"
    out = tmp_path / "data.h5"
    process = start_command("campaign", "--count", 600, "--out", out, "--native", solver="solve", before=before)
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors.count("\n")) == (1, 1), errors
    assert "File too large" in errors
    assert "the same command continues" in errors
    assert not out.exists()
    assert bool(parts(out)) == (limit > 50_000)
    assert not list(tmp_path.rglob("*.writing"))


def test_a_killed_worker_costs_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("STAND_IN_MARKER", str(tmp_path / "marker"))
    get_reusable_executor().shutdown(wait=True)  # workers see the variable only when they start after it
    plan = Campaign(count=60, seed=4)
    summary = run_campaign(plan, tmp_path / "data.h5", workers=2, solver=stand_in.kills_its_worker_once)
    assert (tmp_path / "marker").exists()
    assert (summary.count, summary.failures) == (60, Counter())
    run_campaign(plan, tmp_path / "calm.h5", solver=stand_in.slow)
    assert_same_numbers(tmp_path / "data.h5", tmp_path / "calm.h5")


@pytest.mark.slow
def test_cluster_gives_the_same_numbers_with_a_worker_killed(plan, undisturbed_slow, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("PYTHONPATH", str(HERE))
    out = tmp_path / "data.h5"
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster:
        victim = next(iter(cluster.workers.values())).pid
        killed = []

        def kill_one(done, failed):
            if done > 20 and not killed:
                killed.append(os.kill(victim, signal.SIGKILL))

        address = cluster.scheduler_address
        summary = run_campaign(plan, out, cluster=address, solver=stand_in.slow, progress=kill_one)
    assert killed
    assert (summary.count, summary.failures) == (120, Counter())
    assert_same_numbers(out, undisturbed_slow)
    with pytest.raises(CampaignError, match="no Dask scheduler answers at"):
        Cluster(address, patience=1.0)


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("tcp://127.0.0.1:9", "no Dask scheduler answers at 'tcp://127.0.0.1:9'"),
        ("teleport://here", "cluster must be an address like"),
    ],
)
def test_dead_scheduler(address, message, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(Cluster.__init__, "__defaults__", (1.0,))
    result = command("campaign", "--count", "3", "--out", tmp_path / "x.h5", "--cluster", address)
    assert (result.exit_code > 0, message in result.stderr, result.stderr.count("\n")) == (True, True, 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_trajectory_that_always_kills_its_worker_is_recorded(tmp_path):
    plan = Campaign(count=200, seed=4)
    deadly = (plan.protocols["tabor"] > 3.0) & (plan.protocols["peak_indentation"] > 90.0)
    assert 0 < deadly.sum() < 5
    run_campaign(plan, tmp_path / "data.h5", workers=2, solver=stand_in.kills_its_worker_always)
    dataset = load_dataset(tmp_path / "data.h5")
    np.testing.assert_array_equal(dataset.columns["status"], deadly)
    assert "worker process died every time" in dataset.columns["reason"][deadly][0]


def test_a_full_disk_ends_in_one_sentence_and_loses_nothing(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    monkeypatch.setattr(bem.parts, "SECONDS_BETWEEN_PARTS", 0.0)
    write_bytes, left = Path.write_bytes, [3]

    def until_full(path, content):
        if left[0] == 0:
            write_bytes(path, content[: len(content) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        left[0] -= 1
        return write_bytes(path, content)

    with monkeypatch.context() as full:
        full.setattr(Path, "write_bytes", until_full)
        with pytest.raises(CampaignError, match=r"No space left on device.*the same command continues"):
            run_campaign(plan, out, solver=stand_in.solve)
    assert len(parts(out)) == 3
    assert not out.exists()
    summary = run_campaign(plan, out, solver=stand_in.solve)
    assert 0 < summary.computed < 120
    assert_same_numbers(out, undisturbed)


def test_a_disk_full_at_the_very_end_keeps_the_parts(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"

    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(bem.dataset_file, "move_into_place", full)
        with pytest.raises(CampaignError, match="No space left on device"):
            run_campaign(plan, out, solver=stand_in.solve)
    assert not out.exists()
    assert not list(tmp_path.glob("*.writing"))
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert_same_numbers(out, undisturbed)


@pytest.mark.parametrize("harm", ["truncate", "flip", "empty"])
def test_a_damaged_part_is_computed_again(harm, plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    monkeypatch.setattr(bem.parts, "SECONDS_BETWEEN_PARTS", 0.0)
    with monkeypatch.context() as patch:
        patch.setattr("bem.campaign.write_dataset", lambda *_: (_ for _ in ()).throw(OSError("unplugged")))
        with pytest.raises(CampaignError, match="unplugged"):
            run_campaign(plan, out, solver=stand_in.solve)
    path = parts(out)[0]
    content = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        size = len(file["index"])
    content[len(content) // 2] ^= 1
    path.write_bytes({"truncate": content[: len(content) // 2], "flip": content, "empty": b""}[harm])
    summary = run_campaign(plan, out, solver=stand_in.solve)
    assert (summary.damaged, summary.computed) == (1, size)
    assert_same_numbers(out, undisturbed)


def test_two_campaigns_on_one_file_exclude_each_other(plan, tmp_path):
    out = tmp_path / "data.h5"
    process = start_campaign(out, count=4000)
    try:
        await_parts(out, process, 1)
        with pytest.raises(CampaignError, match="another campaign is writing"):
            run_campaign(Campaign(count=4000, seed=4, native=True), out, solver=stand_in.slow)
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
    with pytest.raises(ValueError, match=r"another one is under way: count 4000 there and 120 here"):
        run_campaign(plan, out, solver=stand_in.slow)


def test_the_same_command_again_does_nothing(plan, undisturbed):
    content = undisturbed.read_bytes()
    assert run_campaign(plan, undisturbed, solver=stand_in.solve).computed == 0
    assert undisturbed.read_bytes() == content


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"seed": 5}, "seed 4 there and 5 here"),
        ({"accuracy": "draft"}, "accuracy 'standard' there and 'draft' here"),
        ({"design": Design("sobol")}, "design 'paper' there and 'sobol' here"),
    ],
)
def test_another_campaign_does_not_overwrite(change, message, undisturbed, tmp_path):
    plan = Campaign(**{"count": 120, "seed": 4, "native": True} | change)
    content = undisturbed.read_bytes()
    with pytest.raises(ValueError, match=message):
        run_campaign(plan, undisturbed, solver=stand_in.solve)
    assert undisturbed.read_bytes() == content
    copy = tmp_path / "data.h5"
    copy.write_bytes(content)
    assert run_campaign(plan, copy, solver=stand_in.solve, replace=True).computed == 120
    run_campaign(plan, tmp_path / "fresh.h5", solver=stand_in.solve)
    assert_same_numbers(copy, tmp_path / "fresh.h5")


def test_another_version_of_the_solver_is_told_apart(plan, undisturbed):
    with pytest.raises(ValueError, match="made by another version of the solver"):
        run_campaign(plan, undisturbed, solver=stand_in.slow)


def test_shards_merge_into_the_undisturbed_file(undisturbed, tmp_path):
    out = tmp_path / "data.h5"
    paths = []
    for number in (2, 3, 1):
        plan = Campaign(count=120, seed=4, native=True, shard=(number, 3))
        paths.append(run_campaign(plan, out, solver=stand_in.solve).path)
    assert paths[0].name == "data.shard-2-of-3.h5"
    assert len(load_dataset(paths[0])) == 40
    with pytest.raises(ValueError, match="without 40 of them, the first being trajectory 0"):
        merge(paths[:2], out)
    with pytest.raises(ValueError, match="must not overlap"):
        merge([*paths, paths[0]], out)
    assert not out.exists()
    assert merge(paths, out).count == 120
    assert_same_numbers(out, undisturbed)
    with pytest.raises(ValueError, match="must not overlap"):
        merge([paths[0], undisturbed], tmp_path / "other.h5")


def test_verify_computes_a_sample_again(undisturbed, tmp_path):
    found = verify(undisturbed, sample=10, seed=0, solver=stand_in.solve)
    assert found.agrees
    assert found.identical == len(found.indices) == 10
    altered = tmp_path / "altered.h5"
    altered.write_bytes(undisturbed.read_bytes())
    with h5py.File(altered, "r+") as file:
        file["fms/force"][:, 60] += np.float32(0.1)
    assert not verify(altered, sample=10, seed=0, solver=stand_in.solve).agrees
    with h5py.File(altered, "r+") as file:
        file["protocols/tabor"][3] = 1.234
    with pytest.raises(ValueError, match="protocols must be those of the design"):
        verify(altered, solver=stand_in.solve)


def test_verify_asks_another_build_for_the_accuracy_and_the_same_build_for_rounding(undisturbed, tmp_path):
    nudged = tmp_path / "nudged.h5"
    nudged.write_bytes(undisturbed.read_bytes())
    with h5py.File(nudged, "r+") as file:
        file["fms/force"][...] *= np.float32(1.0 + 1e-4)
    assert not verify(nudged, sample=10, seed=0, solver=stand_in.solve).agrees
    with h5py.File(nudged, "r+") as file:
        file.attrs["host"] = "Linux x86_64, 8 cores of Another Processor"
    found = verify(nudged, sample=10, seed=0, solver=stand_in.solve)
    assert found.agrees
    assert not found.same_build
    with h5py.File(nudged, "r+") as file:
        file["fms/force"][:, 60] += np.float32(0.1)
    assert not verify(nudged, sample=10, seed=0, solver=stand_in.solve).agrees


def test_batches_hold_every_trajectory_once_and_the_costliest_first():
    protocols = Design("paper").protocols(3000, seed=0)
    cost = expected_cost(protocols)
    batches = batches_of(np.arange(3000), cost, workers=2)
    assert sorted(index for batch in batches for index in batch) == list(range(3000))
    assert max(map(len, batches)) <= 32
    shares = [cost[list(batch)].sum() for batch in batches]
    assert max(shares) < 1.5 * np.sum(cost) / (2 * 48)
    assert cost[list(batches[0])].min() >= cost[list(batches[-1])].max()


def test_rate_line():
    assert rate_line(10, 20, 0, 5.0) == "2.0 a second, none failed, 0:00:10 left"
    assert rate_line(0, 20, 3, 0.0) == "3 failed"


def bad_files(folder, undisturbed):
    (folder / "foreign.h5").write_text("not HDF5\n", encoding="utf-8")
    (folder / "truncated.h5").write_bytes(undisturbed.read_bytes()[:20_000])
    (folder / "older.h5").write_bytes(undisturbed.read_bytes())
    with h5py.File(folder / "older.h5", "r+") as file:
        file.attrs["format_version"] = 0
    with h5py.File(folder / "other.h5", "w") as file:
        file["x"] = 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("absent.h5", "data set file not found"),
        ("foreign.h5", "not HDF5"),
        ("truncated.h5", "truncated or damaged"),
        ("older.h5", "which is of version 0"),
        ("other.h5", "an HDF5 file of another kind"),
    ],
)
def test_files_that_are_no_data_sets(name, message, undisturbed, tmp_path):
    bad_files(tmp_path, undisturbed)
    result = command("campaign", "--verify", tmp_path / name)
    assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (2, True, 1)
    if name == "absent.h5":
        return
    content = (tmp_path / name).read_bytes()
    for options in ([], ["--replace"]):
        result = command("campaign", "--count", "3", "--out", tmp_path / name, *options)
        assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (2, True, 1)
        assert (tmp_path / name).read_bytes() == content
    result = command("merge", tmp_path / name, "--out", tmp_path / "merged.h5")
    assert (result.exit_code, message in result.stderr) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message", "code"),
    [
        ([], "campaign needs --out FILE.h5", 2),
        (["--out", "/proc/nowhere/data.h5"], "cannot write beside '/proc/nowhere/data.h5'", 1),
        (["--out", "."], "out must be a file", 2),
        (["--out", "x.h5", "--count", "0"], "count must be a whole number from 1", 2),
        (["--out", "x.h5", "--count", "600000"], "count must be a whole number from 1 to 559872", 2),
        (["--out", "x.h5", "--design", "grid"], "design must be one of", 2),
        (["--out", "x.h5", "--range", "tabor=3:1"], "must have its lower bound first", 2),
        (["--out", "x.h5", "--range", "dwell_time=-1:1"], "lower bound of dwell_time must be", 2),
        (["--out", "x.h5", "--accuracy", "superb"], "accuracy", 2),
        (["--out", "x.h5", "--shard", "4/3"], "shard must be a whole number from 1 to 3", 2),
        (["--out", "x.h5", "--shard", "one"], "shard must read i/n", 2),
        (["--out", "x.h5", "--workers", "0"], "workers must be a whole number from 1", 2),
        (["--out", "x.h5", "--design-file", "absent.toml"], "design file not found", 2),
    ],
)
def test_bad_options_end_in_one_sentence(arguments, message, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = command("campaign", *arguments)
    assert (result.exit_code, message in result.stderr, result.stderr.count("\n")) == (code, True, 1), result.stderr
    assert not list(tmp_path.iterdir())


def test_design_file_and_options_together(tmp_path, monkeypatch):
    called = []
    monkeypatch.setattr("bem.campaign_cli._run", lambda settings, _out, **rest: called.append((settings, rest)))
    path = tmp_path / "design.toml"
    path.write_text('design = "sobol"\ncount = 5\n[ranges]\ntabor = [1.0, 2.0]\n', encoding="utf-8")
    result = command(
        "campaign",
        "--out",
        "x.h5",
        "--design-file",
        path,
        "--count",
        "7",
        "--range",
        "dwell_time=1",
        "--accuracy",
        "1e-3",
    )
    assert result.exit_code == 0, result.stderr
    settings, rest = called[0]
    ranges = {"tabor": [1.0, 2.0], "dwell_time": (1.0, 1.0)}
    assert settings == {"design": "sobol", "count": 7, "accuracy": 1e-3, "ranges": ranges}
    assert rest["shard"] == (1, 1)
