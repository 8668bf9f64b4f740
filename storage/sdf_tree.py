"""SDF to a tree of what has to be looked at; nothing of a stranger's file is trusted."""

from collections.abc import Collection
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET
from xml.parsers import expat

from ses_core.errors import WorldError

_DEEPEST = 64
"""Models in models nest a few times over; what goes deeper would exhaust the stack."""


def sdf_tree(text: str, path: Path, *, without: Collection[str]) -> ET.Element:
    """Parse SDF, leaving out elements of some names with all that is in them.

    Gazebo repeats every model in the state it saved: most of a file is nothing for us to build.

    Raises:
        WorldError: It is no XML, declares a document type, or nests too deep.
    """
    builder = ET.TreeBuilder()
    # The text was decoded already, whatever encoding it declares.
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    depth = skipped = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, skipped
        if name in without:
            skipped = 1
            build(start_skipped, end_skipped, None)
            return
        depth += 1
        if depth > _DEEPEST:
            raise WorldError(
                f"{path} nests elements more than {_DEEPEST} deep, expected models that hold links"
            )
        builder.start(name, attributes)

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(name)

    def start_skipped(_name: str, _attributes: dict[str, str]) -> None:
        nonlocal skipped
        skipped += 1

    def end_skipped(_name: str) -> None:
        nonlocal skipped
        skipped -= 1
        if not skipped:
            build(start, end, builder.data)

    def build(start: Any, end: Any, data: Any) -> None:
        # Handlers are exchanged: most of a saved world is skipped, and then they do almost nothing.
        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.CharacterDataHandler = data

    def refuse_document_type(*_: object) -> None:
        raise WorldError(f"{path} declares a document type, expected plain SDF without entities")

    parser.StartDoctypeDeclHandler = refuse_document_type
    build(start, end, builder.data)
    try:
        parser.Parse(text.encode(), True)
        root: ET.Element = builder.close()
    except expat.ExpatError as error:
        raise WorldError(f"{path} is no XML: {error}") from error
    except AssertionError as error:
        # The outermost element itself was left out.
        raise WorldError(f"{path} is no XML: nothing but what is left out") from error
    return root
