"""The ROS message types we understand, and whether a log's own definitions agree with them.

Only these built-in definitions ever decode a message: a definition that a log brings along is
compared, never compiled, because rosbags turns definitions into Python code.
"""

import re
from functools import cache

from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ses_core.errors import LogError

_DEFINITION_LIMIT = 64 * 1024
_TRANSFORMS_DEFINITION = "geometry_msgs/TransformStamped[] transforms"
_SEPARATOR = re.compile(r"^=+\n", re.MULTILINE)


@cache
def ros1_types() -> Typestore:
    """Give the types of ROS 1 Noetic with both transform messages, old and new."""
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):
        store.register(get_types_from_msg(_TRANSFORMS_DEFINITION, name))
    return store


@cache
def ros2_types() -> Typestore:
    """Give the types of ROS 2 Humble; the ones we use are the same in every release."""
    return get_typestore(Stores.ROS2_HUMBLE)


def require_known_definition(connection: Connection, types: Typestore, *, ros_version: int) -> None:
    """Refuse a topic whose own message definition differs from the built-in one.

    Raises:
        LogError: `unknown_definition`.
    """
    definition = connection.msgdef
    if definition.format == MessageDefinitionFormat.NONE:
        return
    if len(definition.data) > _DEFINITION_LIMIT:
        raise LogError(
            "unknown_definition",
            f"definition of {connection.msgtype!r} has {len(definition.data)} characters, "
            f"expected at most {_DEFINITION_LIMIT}",
        )
    if definition.format == MessageDefinitionFormat.IDL:
        agrees = connection.digest == types.hash_rihs01(connection.msgtype)
    else:
        agrees = _includes(definition.data, _known_fields(connection.msgtype, ros_version))
    if not agrees:
        raise LogError(
            "unknown_definition",
            f"definition of {connection.msgtype!r} on topic {connection.topic!r} "
            "is not the one known to ROS",
        )


@cache
def _known_fields(message_type: str, ros_version: int) -> tuple[tuple[str, tuple[str, ...]], ...]:
    types = ros1_types() if ros_version == 1 else ros2_types()
    text, _ = types.generate_msgdef(message_type, ros_version=ros_version)
    return tuple(_sections(text).items())


def _includes(text: str, known: tuple[tuple[str, tuple[str, ...]], ...]) -> bool:
    """Tell whether a definition states every known part exactly as known."""
    stated = _sections(text)
    return all(stated.get(name) == fields for name, fields in known)


def _sections(text: str) -> dict[str, tuple[str, ...]]:
    """Split a definition into its parts: name -> fields, without comments and packages.

    The message itself has the empty name. ROS 1 and 2 spell packages differently, so only the
    last part of a type's name counts.
    """
    sections: dict[str, tuple[str, ...]] = {}
    for part in _SEPARATOR.split(text.replace("\r\n", "\n")):
        lines = [re.sub(r"\s+", " ", line.split("#")[0]).strip() for line in part.splitlines()]
        lines = [line for line in lines if line]
        name = ""
        if lines and lines[0].startswith("MSG: "):
            name = lines.pop(0).rpartition("/")[2]
        # ROS 1 generators print a part once per use, and each time the same.
        sections.setdefault(name, tuple(_field(line) for line in lines))
    return sections


def _field(line: str) -> str:
    kind, _, rest = line.partition(" ")
    return f"{kind.rpartition('/')[2]} {re.sub(r' ?= ?', '=', rest)}"
