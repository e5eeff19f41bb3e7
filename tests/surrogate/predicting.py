"""What the tests of `surrogate predict` share: a protocol, its options, and how a mistake must end."""

PROTOCOL = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}
FLAGS = [word for key, value in PROTOCOL.items() for word in (f"--{key.replace('_', '-')}", str(value))]


def refused(command, words, *, folder):
    """The one sentence a mistake ends in; nothing may be left behind."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    code, out, err = command(*words)
    assert (code, out) == (2, ""), err
    assert err.startswith("surrogate: Expected ")
    assert err.count("\n") == 1
    assert len(err) < 1000
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    return err
