"""Operations on the data set files that campaigns have written: find the campaign, join shards."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bem._support.outputs import require_suffix
from bem._support.provenance import merged, provenance
from bem._support.wording import shown
from bem.dataset.campaign.checkpoints import differences
from bem.dataset.campaign.plan import Campaign
from bem.dataset.campaign.run import Summary, existing, followed, summary_of, write_file
from bem.dataset.designs import Design
from bem.dataset.file import SUFFIXES, Dataset, load_dataset
from bem.dataset.records import Record, untabulate


def campaign_of(attributes: dict[str, Any]) -> Campaign:
    """Return the campaign of a data set file with these root attributes.

    Raises:
        ValueError: they describe no campaign.
    """
    identity = attributes["campaign"]
    try:
        number, total = identity["shard"].split("/")
        return Campaign(
            design=Design(identity["design"], identity["ranges"], identity["modulus_ratio"]),
            **{name: identity[name] for name in ("count", "seed", "accuracy", "native")},
            counts=tuple(identity["counts"]),
            steps=identity.get("steps", "uniform"),
            shard=(int(number), int(total)),
        )
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(
            f"expected a data set whose attribute 'campaign' describes one; received {shown(identity)}"
        ) from error


def merge(shards: Sequence[str | Path], out: str | Path, *, command: str = "", replace: bool = False) -> Summary:
    """Join the data set files of all shards of a campaign into one.

    Raises:
        FileNotFoundError, ValueError: for files that are not data sets, belong to different campaigns, overlap or are
            incomplete, or for an `out` that does not end in .h5 or .hdf5.
        CampaignError: when the result cannot be written.
    """
    if not shards:
        raise ValueError("shards must name at least one data set file; received none")
    require_suffix(out, SUFFIXES)
    out = followed(Path(out))
    datasets: list[Dataset] = []
    records: dict[int, Record] = {}
    identity: dict[str, Any] = {}
    for path in shards:
        dataset = load_dataset(path, native=True)
        campaign_of(dataset.attributes)
        described = {**dataset.attributes["campaign"], "shard": "1/1"}
        identity = identity or described
        if difference := differences(identity, described):
            raise ValueError(f"shards must belong to one campaign; received {str(path)!r}: {difference}")
        if not records.keys().isdisjoint(dataset.columns["index"].tolist()):
            number = dataset.attributes["campaign"]["shard"]
            raise ValueError(f"shards must not overlap; received {str(path)!r}, shard {number}, a second time")
        datasets.append(dataset)
        records |= {record.index: record for record in untabulate(dataset.columns)}
    absent = sorted(set(range(identity["count"])) - records.keys())
    if absent:
        raise ValueError(
            f"shards must hold all {identity['count']} trajectories; received files without {len(absent)} of them, "
            f"the first being trajectory {absent[0]}"
        )
    campaign = campaign_of({"campaign": identity})
    # A merged file of this campaign is made anew: its shards may have been completed since.
    existing(campaign, out, identity, replace=replace)
    columns = campaign.columns(records.values())
    attributes = {"campaign": identity} | provenance(command) | _joined([found.attributes for found in datasets])
    write_file(campaign, out, columns, attributes)
    return summary_of(out, columns, attributes)


def _joined(shards: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Cost and origin of shards that were computed side by side."""
    wall, core, workers = ([found[name] for found in shards] for name in ("wall_seconds", "core_seconds", "workers"))
    names = ("versions", "host", "git_revision")
    origins = merged({name: found[name] for name in names if name in found} for found in shards)
    memory = max(found.get("peak_memory", 0) for found in shards)
    cost = {"wall_seconds": max(wall), "core_seconds": sum(core), "workers": sum(workers), "peak_memory": memory}
    return cost | origins
