"""Train models of the paper by its recipe on one GPU, many at once, with PyTorch and CuPy; no Keras is needed here.

`exchange.py prepare` writes what is read (`data.npz`, `jobs.json`), `exchange.py collect` makes folders of runs of what
is written. Each job is a training of `surrogate.training.fitting`: the same initial weights, batches and order, Adam as
Keras computes it, ReduceLROnPlateau and EarlyStopping, float32. Only dropout draws other numbers. Whole epochs run as
CUDA graphs. The recurrent part of an LSTM is a kernel of its own (`kernels.cu`), compared with PyTorch's at the start.

Usage: `python train.py FOLDER SECONDS [--at-once N] [--only LABEL ...]`.
"""

from __future__ import annotations

import argparse
import json
import threading
import time
from pathlib import Path
from typing import Any

import cupy
import numpy as np
import torch
from torch.nn import functional

STEPS, BATCH, UNROLLED = 120, 8, 15
"""Steps of a trajectory, trajectories of a batch, batches of a graph."""
MOST_EPOCHS, PATIENCE, STOP_AFTER, FACTOR, SMALLEST = 2000, 20, 30, 0.5, 1e-7
"""The recipe `paper`."""
PART = 15 << 20
"""Bytes of a part of the weights."""
torch.backends.cuda.matmul.allow_tf32 = False
torch.backends.cudnn.allow_tf32 = False
MODULE = cupy.RawModule(code=(Path(__file__).parent / "kernels.cu").read_text(), options=("--std=c++17",))
KERNELS = {
    name: MODULE.get_function(name) for name in ("fwd128", "bwd128", "fwd256", "bwd256", "im2col", "col2im", "adam")
}
SHARED = {"fwd128": 20 * 256 * 16, "bwd128": 20 * 256 * 16}
for name, size in SHARED.items():
    KERNELS[name].max_dynamic_shared_size_bytes = size
Weights = dict[str, torch.Tensor]


def launch(name: str, blocks: int, *arguments: Any) -> None:
    """Run a kernel on the current stream."""
    with cupy.cuda.ExternalStream(torch.cuda.current_stream().cuda_stream):
        passed = tuple(one.data_ptr() if isinstance(one, torch.Tensor) else np.int32(one) for one in arguments)
        KERNELS[name]((blocks,), (256,), passed, shared_mem=SHARED.get(name, 0))


def blocks_of(batch: int, units: int) -> int:
    """Blocks of a recurrent kernel: one a trajectory, or eight for four of them."""
    return batch if units == 128 else 2 * batch


def recurrent(gates: torch.Tensor, kernel: torch.Tensor, keep: bool) -> tuple[torch.Tensor, tuple[torch.Tensor, ...]]:
    """Outputs of an LSTM, and what its gradient needs, from the inputs' part of its gates (batch, steps, 4 units)."""
    batch, _, width = gates.shape
    units = width // 4
    out = torch.empty(batch, STEPS, units, device="cuda")
    kept = (torch.empty_like(out), torch.empty_like(gates), torch.empty_like(out)) if keep else (out,) * 3
    launch(f"fwd{units}", blocks_of(batch, units), gates, kernel, out, *kept, STEPS, int(keep))
    return out, kept


class LSTM(torch.autograd.Function):
    """An LSTM layer: sequence, kernel, recurrent kernel and bias, in Keras's order of gates."""

    @staticmethod
    def forward(ctx, sequence, kernel, recurrent_kernel, bias):
        """Outputs at all steps."""
        flat = sequence.reshape(-1, sequence.shape[-1])
        gates = torch.addmm(bias, flat, kernel).view(*sequence.shape[:2], -1)
        out, kept = recurrent(gates, recurrent_kernel, keep=True)
        ctx.save_for_backward(flat, kernel, recurrent_kernel, *kept)
        return out

    @staticmethod
    def backward(ctx, grad):
        """Gradients of all four."""
        flat, kernel, recurrent_kernel, before, gates, cells = ctx.saved_tensors
        grad, units = grad.contiguous(), grad.shape[-1]
        change = torch.empty_like(gates)
        launch(f"bwd{units}", blocks_of(len(grad), units), grad, recurrent_kernel, gates, cells, change, STEPS)
        rows = change.view(-1, 4 * units)
        inputs = (rows @ kernel.T).view(*grad.shape[:2], -1) if ctx.needs_input_grad[0] else None
        return inputs, flat.T @ rows, before.view(-1, units).T @ rows, rows.sum(0)


def lstm(sequence: torch.Tensor, weights: Weights, name: str) -> torch.Tensor:
    """The outputs of an LSTM layer at all steps."""
    kernel, recurrent_kernel, bias = (
        weights[f"{name}/lstm_cell/{one}"] for one in ("kernel", "recurrent_kernel", "bias")
    )
    if torch.is_grad_enabled():
        return LSTM.apply(sequence, kernel, recurrent_kernel, bias)
    gates = torch.addmm(bias, sequence.reshape(-1, sequence.shape[-1]), kernel).view(*sequence.shape[:2], -1)
    return recurrent(gates, recurrent_kernel, keep=False)[0]


class Convolution(torch.autograd.Function):
    """A causal convolution of three points as one matrix product."""

    @staticmethod
    def forward(ctx, sequence, kernel, bias, dilation):
        """Outputs at all steps."""
        batch, channels, sequence = len(sequence), sequence.shape[-1], sequence.contiguous()
        columns = torch.empty(batch * STEPS, 3 * channels, device="cuda")
        size = columns.numel()
        launch("im2col", -(-size // 256), sequence, columns, STEPS, channels, dilation, size)
        ctx.save_for_backward(columns, kernel)
        ctx.dilation = dilation
        return torch.addmm(bias, columns, kernel.view(3 * channels, -1)).view(batch, STEPS, -1)

    @staticmethod
    def backward(ctx, grad):
        """Gradients of sequence, kernel and bias."""
        columns, kernel = ctx.saved_tensors
        channels, filters = kernel.shape[1:]
        flat, inputs = grad.reshape(-1, filters), None
        if ctx.needs_input_grad[0]:
            change = flat @ kernel.view(3 * channels, filters).T
            inputs = torch.empty(len(grad), STEPS, channels, device="cuda")
            size = inputs.numel()
            launch("col2im", -(-size // 256), change, inputs, STEPS, channels, ctx.dilation, size)
        return inputs, (columns.T @ flat).view(kernel.shape), flat.sum(0), None


def convolution(sequence: torch.Tensor, weights: Weights, name: str, dilation: int = 1) -> torch.Tensor:
    """A causal convolution of three points."""
    return Convolution.apply(sequence, weights[f"{name}/kernel"], weights[f"{name}/bias"], dilation)


def dense(values: torch.Tensor, weights: Weights, name: str) -> torch.Tensor:
    """A dense layer on the last axis, whose kernel may have several axes."""
    bias = weights[f"{name}/bias"].reshape(-1)
    kernel = weights[f"{name}/kernel"].reshape(-1, bias.numel())
    found = torch.addmm(bias, values.reshape(-1, len(kernel)), kernel)
    return found.view(*values.shape[:-1], -1)


def norm(values: torch.Tensor, weights: Weights, name: str) -> torch.Tensor:
    """A layer normalisation."""
    return functional.layer_norm(values, values.shape[-1:], weights[f"{name}/gamma"], weights[f"{name}/beta"], 1e-3)


def film(hidden: torch.Tensor, tabor: torch.Tensor, weights: Weights) -> torch.Tensor:
    """The layer FiLM."""
    context = torch.relu(dense(tabor, weights, "film/context"))
    scale, shift = (dense(context, weights, f"film/{one}")[:, None] for one in ("scale", "shift"))
    return torch.addcmul(shift, scale, hidden)


def gate(first: torch.Tensor, second: torch.Tensor, tabor: torch.Tensor, weights: Weights) -> torch.Tensor:
    """The layer TaborGate."""
    context = torch.relu(dense(tabor, weights, "gate/context"))
    share = torch.softmax(dense(context, weights, "gate/weighting"), -1)[:, None]
    return share[..., :1] * first + share[..., 1:] * second


def appended(sequence: torch.Tensor, tabor: torch.Tensor, how: str) -> torch.Tensor:
    """The sequence, for "concat" with the Tabor parameter."""
    return torch.cat([sequence, tabor[:, None].expand(-1, STEPS, -1)], -1) if how == "concat" else sequence


def ending(hidden: torch.Tensor, tabor: torch.Tensor, how: str, weights: Weights) -> torch.Tensor:
    """Features, for "FiLM" modulated, for "gated" combined with their normalisation."""
    if how == "FiLM":
        return film(hidden, tabor, weights)
    return gate(hidden, norm(hidden, weights, "normalisation"), tabor, weights) if how == "gated" else hidden


def m1(x, tabor, how, weights, training):  # noqa: ARG001
    """M1."""
    if how == "gated":
        return gate(lstm(x, weights, "expert_1"), lstm(x, weights, "expert_2"), tabor, weights)
    hidden = lstm(lstm(appended(x, tabor, how), weights, "lstm_1"), weights, "lstm_2")
    return film(hidden, tabor, weights) if how == "FiLM" else hidden


def m2(x, tabor, how, weights, training):  # noqa: ARG001
    """M2."""
    hidden = norm(lstm(appended(x, tabor, how), weights, "lstm_1"), weights, "normalisation_1")
    found = lstm(hidden, weights, "lstm_2")
    hidden = norm(found, weights, "normalisation_2")
    if how == "FiLM":
        return film(hidden, tabor, weights)
    return gate(found, hidden, tabor, weights) if how == "gated" else hidden


def m3(x, tabor, how, weights, training):  # noqa: ARG001
    """M3."""
    hidden = appended(x, tabor, how)
    for number in "12":
        hidden = torch.relu(convolution(hidden, weights, f"convolution_{number}"))
    return ending(lstm(hidden, weights, "lstm"), tabor, how, weights)


def m4(x, tabor, how, weights, training):
    """M4."""
    hidden, found = x, []
    for number, dilation in enumerate((1, 2, 4, 8), 1):
        path = hidden
        for stage in (f"block_{number}/first", f"block_{number}/second"):
            path = convolution(path, weights, f"{stage}_convolution", dilation)
            path = torch.relu(norm(path, weights, f"{stage}_normalisation"))
            path = functional.dropout(path, 0.1) if training else path
        projection = f"block_{number}/projection"
        hidden = path + (dense(hidden, weights, projection) if f"{projection}/kernel" in weights else hidden)
        found.append(hidden)
    if how == "FiLM":
        return film(hidden, tabor, weights)
    return gate(hidden, found[2], tabor, weights) if how == "gated" else appended(hidden, tabor, how)


def m5(x, tabor, how, weights, training):  # noqa: ARG001
    """M5."""
    hidden = dense(appended(x, tabor, how), weights, "projection")
    for number in "12":
        block = f"block_{number}"
        query, key, value = (
            dense(hidden, weights, f"{block}/attention/{one}").view(-1, STEPS, 4, 128).transpose(1, 2)
            for one in ("query", "key", "value")
        )
        heads = torch.softmax((query * 128**-0.5) @ key.transpose(2, 3), -1) @ value
        joined = dense(heads.transpose(1, 2).reshape(-1, STEPS, 512), weights, f"{block}/attention/attention_output")
        hidden = norm(hidden + joined, weights, f"{block}/attention_normalisation")
        wide = torch.relu(dense(hidden, weights, f"{block}/expand"))
        hidden = norm(hidden + dense(wide, weights, f"{block}/contract"), weights, f"{block}/output_normalisation")
    return ending(hidden, tabor, how, weights)


def m6(x, tabor, how, weights, training):  # noqa: ARG001
    """M6."""
    first = lstm(appended(x, tabor, how), weights, "lstm_1")
    total = first + lstm(first, weights, "lstm_2")
    hidden = norm(total, weights, "normalisation")
    hidden = lstm(gate(total, hidden, tabor, weights) if how == "gated" else hidden, weights, "lstm_3")
    return film(hidden, tabor, weights) if how == "FiLM" else hidden


FAMILIES = {"M1": m1, "M2": m2, "M3": m3, "M4": m4, "M5": m5, "M6": m6}


def predict(architecture: str, weights: Weights, x: torch.Tensor, tabor: torch.Tensor, training: bool) -> torch.Tensor:
    """The scaled force, shape (batch, steps, 1)."""
    family, how = architecture.split("-")
    hidden = FAMILIES[family](x, tabor, how, weights, training)
    return dense(torch.relu(dense(hidden, weights, "readout_hidden")), weights, "force")


def views(flat: torch.Tensor, shapes: dict[str, list[int]]) -> Weights:
    """The weights of a network as parts of one vector."""
    found, at = {}, 0
    for name, shape in shapes.items():
        count = int(np.prod(shape))
        found[name] = flat[at : at + count].view(shape)
        at += count
    return found


class Job:
    """One training. `job` is an entry of `jobs.json`, `data` the tensors of `data.npz`."""

    def __init__(self, job: dict[str, Any], data: dict[str, torch.Tensor], start: dict[str, np.ndarray]) -> None:
        self.label, self.architecture, self.gain, self.data = job["label"], job["architecture"], job["gain"], data
        self.stream = torch.cuda.Stream()
        self.train_x, self.val_x = (data[f"{part}_{job['features']}"] for part in ("train", "val"))
        self.state = {name: torch.tensor(start[name], device="cuda") for name in ("flat", "m", "v", "best")}
        self.leaves = {
            name: one.detach().requires_grad_() for name, one in views(self.state["flat"], job["shapes"]).items()
        }
        self.updates = torch.tensor([int(start["updates"])], dtype=torch.int32, device="cuda")
        self.at, self.order = (torch.zeros(n, dtype=torch.int64, device="cuda") for n in (1, len(self.train_x)))
        self.span = torch.arange(BATCH, device="cuda")
        self.total, self.scores = torch.zeros(1, dtype=torch.float64, device="cuda"), torch.zeros(2, device="cuda")
        self.history: list[list[float]] = []
        self.rate, self.least, self.wait, self.finished, self.error = float(np.float32(1e-4)), np.inf, 0, False, ""
        self.rate_now = torch.tensor([self.rate], device="cuda")
        for row in start["history"].tolist():
            self.history.append(row)
            self.judge()

    def step(self) -> None:
        """One batch."""
        rows = self.order[self.at + self.span]
        found = predict(self.architecture, self.leaves, self.train_x[rows], self.data["train_tabor"][rows], True)
        loss = functional.mse_loss(found, self.data["train_force"][rows])
        flat = torch.cat([one.reshape(-1) for one in torch.autograd.grad(loss, list(self.leaves.values()))])
        moved = (self.state["flat"], flat, self.state["m"], self.state["v"])
        launch("adam", -(-flat.numel() // 256), *moved, self.rate_now, self.updates, flat.numel())
        self.total += loss.detach()
        self.updates += 1
        self.at += BATCH

    def score(self) -> None:
        """Errors of the validation set."""
        with torch.no_grad():
            found = predict(self.architecture, self.leaves, self.val_x, self.data["val_tabor"], False)
            rest = found[: len(self.data["val_force"])] - self.data["val_force"]
            self.scores[0], self.scores[1] = (rest * rest).mean(), rest.abs().mean()

    def capture(self) -> None:
        """Record the graphs; the state is as before."""
        moved = [*self.state.values(), self.updates]
        before = [one.clone() for one in moved]
        self.stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(self.stream):
            for _ in range(2):
                self.step()
            self.score()
        self.stream.synchronize()
        self.graphs = torch.cuda.CUDAGraph(), torch.cuda.CUDAGraph()
        with torch.cuda.graph(self.graphs[0], stream=self.stream, capture_error_mode="relaxed"):
            for _ in range(UNROLLED):
                self.step()
        with torch.cuda.graph(self.graphs[1], stream=self.stream, capture_error_mode="relaxed"):
            self.score()
        with torch.cuda.stream(self.stream):
            for one, value in zip(moved, before, strict=True):
                one.copy_(value)
        self.stream.synchronize()

    def epoch(self) -> list[float]:
        """Train for one epoch; return its errors: of training, and squared and absolute of validation."""
        batches = len(self.train_x) // BATCH
        order = np.random.default_rng([0, len(self.history) + 1]).permutation(len(self.train_x))
        with torch.cuda.stream(self.stream):
            self.rate_now.fill_(self.rate)
            self.order.copy_(torch.from_numpy(order))
            self.at.zero_()
            self.total.zero_()
            for _ in range(batches // UNROLLED):
                self.graphs[0].replay()
            self.graphs[1].replay()
            self.stream.synchronize()
            return [float(self.total) / batches, *self.scores.tolist()]

    def judge(self) -> bool:
        """Follow the rules of the plateau and of the end; return whether the last epoch is the best one."""
        errors = [row[3] for row in self.history]
        if errors[-1] < self.least - self.gain:
            self.least, self.wait = errors[-1], 0
        else:
            self.wait += 1
            if self.wait >= PATIENCE:
                if self.rate > np.float32(SMALLEST):
                    self.rate = float(np.float32(max(self.rate * FACTOR, SMALLEST)))
                self.wait = 0
        best = errors.index(min(errors)) + 1
        self.finished = len(errors) - best >= STOP_AFTER or len(errors) >= MOST_EPOCHS
        return best == len(errors)

    def run(self, turn: threading.Semaphore, deadline: float) -> None:
        """Train until the recipe or the deadline ends it."""
        with turn:
            try:
                spent = self.history[-1][5] if self.history else 0.0
                started = time.perf_counter() - spent
                while not self.finished and time.time() < deadline:
                    row = [float(len(self.history) + 1), self.rate, *self.epoch()]
                    if not np.isfinite(row[3]):
                        raise FloatingPointError(f"validation error {row[3]} in epoch {row[0]:g}")
                    self.history.append([*row, time.perf_counter() - started])
                    if self.judge():
                        with torch.cuda.stream(self.stream):
                            self.state["best"].copy_(self.state["flat"])
                self.stream.synchronize()
            except Exception as error:
                self.error = repr(error)[:300]


def check() -> None:
    """Compare the kernels with PyTorch's LSTM.

    Raises:
        ArithmeticError: an output or a gradient differs.
    """
    for units in (128, 256):
        torch.manual_seed(3)
        given = [torch.randn(8, STEPS, 64, device="cuda")]
        given += [0.08 * torch.randn(*shape, device="cuda") for shape in ((64, 4 * units), (units, 4 * units))]
        given = [one.requires_grad_() for one in [*given, 0.08 * torch.randn(4 * units, device="cuda")]]
        grad, zero = torch.randn(8, STEPS, units, device="cuda"), torch.zeros(1, 8, units, device="cuda")
        x, kernel, recurrent_kernel, bias = given
        theirs = [kernel.T.contiguous(), recurrent_kernel.T.contiguous(), bias, torch.zeros_like(bias)]
        outs = LSTM.apply(*given), torch.lstm(x, [zero, zero], theirs, True, 1, 0.0, True, False, True)[0]
        pairs = zip(*((out.detach(), *torch.autograd.grad(out, given, grad)) for out in outs), strict=True)
        worst = max(float((one - other).abs().max() / other.abs().max()) for one, other in pairs)
        print(f"LSTM of {units} units: outputs and gradients differ by {worst:.1e} at most", flush=True)
        if not worst < 1e-4:
            raise ArithmeticError(f"kernels of {units} units")


def loaded(path: Path) -> dict[str, torch.Tensor]:
    """The data set by name, the validation set padded to a multiple of four trajectories, which the kernels take."""
    with np.load(path) as file:
        found = {
            name: torch.tensor(file[name], device="cuda") for name in file.files if name.startswith(("train", "val"))
        }
    for name in [one for one in found if one.startswith("val") and one != "val_force"]:
        found[name] = torch.cat([found[name], found[name][: -len(found[name]) % 4]])
    for part in ("train", "val"):
        whole, acceleration = found[f"{part}_D"], found.pop(f"{part}_acceleration")
        found[f"{part}_A"], found[f"{part}_B"] = whole[..., :2].contiguous(), whole[..., :3].contiguous()
        found[f"{part}_C"] = torch.cat([whole[..., :3], acceleration], -1)
    return found


def main() -> None:
    """Train all jobs until the seconds are over, and write their states."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="of what `exchange.py` wrote; results go there, too")
    parser.add_argument("seconds", type=float, help="after which all is written")
    parser.add_argument("--at-once", type=int, default=8, help="trainings that run at once")
    parser.add_argument("--only", nargs="*", help="labels of jobs")
    chosen = parser.parse_args()
    deadline, here = time.time() + chosen.seconds - 10.0, chosen.folder
    print(torch.cuda.get_device_name(), torch.__version__, flush=True)
    check()
    data, jobs = loaded(here / "data.npz"), []
    with np.load(here / "data.npz") as file:
        for one in json.loads((here / "jobs.json").read_text()):
            if chosen.only and one["label"] not in chosen.only:
                continue
            names = ("flat", "m", "v", "best", "updates", "history")
            jobs.append(Job(one, data, {name: file[f"{one['label']}:{name}"] for name in names}))
            jobs[-1].capture()
    torch.manual_seed(0)
    turn = threading.Semaphore(chosen.at_once)
    threads = [threading.Thread(target=one.run, args=(turn, deadline)) for one in jobs]
    for one in threads:
        one.start()
    while any(one.is_alive() for one in threads):
        threads[0].join(15.0)
        time.sleep(15.0 * (not threads[0].is_alive() and any(one.is_alive() for one in threads)))
        print(" ".join(f"{one.label}:{len(one.history)}" for one in jobs), flush=True)
    table: dict[str, Any] = {"device": torch.cuda.get_device_name(), "torch": torch.__version__, "jobs": {}}
    content = b""
    for one in jobs:
        kept = ["best"] if one.finished else list(one.state)
        table["jobs"][one.label] = {
            "history": one.history,
            "updates": int(one.updates),
            "rate": one.rate,
            "finished": one.finished,
            "parts": kept,
        }
        content += b"".join(one.state[name].cpu().numpy().tobytes() for name in kept)
        print(one.label, len(one.history), "finished" if one.finished else "not finished", one.error, flush=True)
    (chosen.folder / "table.json").write_text(json.dumps(table))
    for number, at in enumerate(range(0, len(content), PART)):
        (chosen.folder / f"weights{number}").write_bytes(content[at : at + PART])


if __name__ == "__main__":
    main()
