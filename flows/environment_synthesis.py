"""Synthesis by hand: from challenging environments to a folder of synthesized ones."""

import shutil
from pathlib import Path

from prefect import flow
from pydantic import BaseModel

from flows.night_stages import batch_day, extract_logs, open_night, select_places
from ses_core.settings import Settings
from storage.environment_files import ENVIRONMENTS_FILE, SYNTHESIS_FILE, read_environments
from storage.night_report import SynthesisUse
from storage.selection_files import read_pool
from storage.stage_records import read_record
from tasks.synthesize import fit_synthesizer, import_environments, sample_environments


class SynthesisSummary(BaseModel):
    """What was synthesized, and what it took."""

    environments: int
    learned_from: int
    method_asked: str
    method_used: str
    drawn: int
    rejected_share: float
    repeated: int
    copied: int
    repaired: int
    repaired_cells: float
    beyond_repair: int
    notes: tuple[str, ...]
    out: str


@flow(name="environment synthesis", flow_run_name="synthesize into {out}")
def synthesize(
    root: Path,
    out: Path,
    source: Path | None = None,
    settings: Settings = Settings(),  # noqa: B008  (frozen; the UI shows it as the form's defaults)
) -> SynthesisSummary:
    """Synthesize environments and write those that can be crossed as one `environments.parquet`.

    Args:
        root: Folder of the store.
        out: Folder that the file goes into.
        source: Folder of environments to learn from; else the store's challenging ones.
        settings: Those of `filter` and `synthesis` and the target robot matter.

    Raises:
        SynthesisError: There is nothing to learn from.
    """
    with open_night(
        root, settings=settings, date=None, refresh=None, purpose="synthesize"
    ) as night:
        if source is not None:
            selection = import_environments.submit(source, store=night.store).result().ref
        else:
            extracted = extract_logs(night)
            selection, _ = select_places(night, extracted, day=batch_day(night))
        fit = fit_synthesizer.submit(
            selection, store=night.store, settings=settings.synthesis
        ).result()
        made = sample_environments.submit(
            fit.ref,
            selection,
            store=night.store,
            settings=settings.synthesis,
            target=settings.target_robot,
        ).result()
        folder = night.store.path(made.ref)
    out.mkdir(parents=True, exist_ok=True)
    # The record goes along: the scorecard wants to know how many samples could not be crossed.
    for name in (SYNTHESIS_FILE, ENVIRONMENTS_FILE):
        shutil.copyfile(folder / name, out / name)
    used = read_record(folder / SYNTHESIS_FILE, SynthesisUse)
    return SynthesisSummary(
        environments=len(read_environments(out).environments),
        learned_from=len(read_pool(night.store.path(selection)).environments),
        method_asked=used.method_asked,
        method_used=used.method_used,
        drawn=used.drawn,
        rejected_share=used.rejected_share,
        repeated=used.repeated,
        copied=used.copied,
        repaired=used.repaired,
        repaired_cells=used.repaired_cells,
        beyond_repair=used.beyond_repair,
        notes=used.notes,
        out=str(out),
    )
