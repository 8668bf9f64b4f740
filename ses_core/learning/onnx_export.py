"""A policy as one ONNX graph, from the robot's own readings to parameters (leaf: onnx).

Inputs, float32, all of one robot or of N:

| name | shape | unit |
| --- | --- | --- |
| `scan` | (N, B) | m, as the laser gives them; inf or NaN where nothing came back |
| `goal_angle` | (N, 1) | rad, to the local goal 1 m ahead on the plan, in the robot's frame |
| `goal_distance` | (N, 1) | m, straight to the goal; only if the policy sees it |
| `parameters` | (N, A) | own units, what it sets as in force; only if the policy sees it |

Output: `next_parameters` (N, A) in their own units. Pooling, clipping, scaling and decoding are
inside, so that a robot needs nothing of this project.
"""

from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

from ses_core.learning.action import ActionSpec
from ses_core.learning.observation import Observer
from ses_core.learning.policies import ParameterPolicy, observer_for
from ses_core.robot_profile import RobotProfile

_OPSET = 18
_IR_VERSION = 8
"""Versions that ONNX Runtime 1.14 (ROS 2 Humble's time) and later read."""


def export_onnx(policy: ParameterPolicy, profile: RobotProfile) -> bytes:
    """Write a policy for one robot's laser as an ONNX model; equal policies give equal bytes."""
    graph = _Graph()
    parts = _scan_part(graph, observer_for(policy, profile))
    spec = policy.observation
    inputs = [_value("scan", profile.laser.beams), _value("goal_angle", 1)]
    parts.append(graph.apply("Mul", "goal_angle", graph.scalar("per_turn", 1 / (2 * np.pi))))
    if spec.goal_clip_m is not None:
        inputs.append(_value("goal_distance", 1))
        near = graph.apply("Min", "goal_distance", graph.scalar("goal_clip", spec.goal_clip_m))
        share = graph.apply("Div", near, "goal_clip")
        parts.append(graph.apply("Sub", share, graph.scalar("half", 0.5)))
    if spec.has_parameters:
        inputs.append(_value("parameters", policy.action.length))
        parts.append(_encoded_parameters(graph, policy.action))
    observation = graph.apply("Concat", *parts, axis=1)
    _decoded_action(graph, _perceptron(graph, policy, observation), policy.action)
    model = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "parameter_policy",
            inputs,
            [_value("next_parameters", policy.action.length)],
            initializer=graph.constants,
        ),
        opset_imports=[helper.make_opsetid("", _OPSET)],
        ir_version=_IR_VERSION,
        producer_name="ses",
    )
    onnx.checker.check_model(model)
    serialized: bytes = model.SerializeToString(deterministic=True)
    return serialized


class _Graph:
    """Nodes and constants of a graph that is being built."""

    def __init__(self) -> None:
        self.nodes: list[NodeProto] = []
        self.constants: list[TensorProto] = []

    def constant(self, name: str, values: NDArray[np.generic]) -> str:
        """Add a named constant."""
        self.constants.append(numpy_helper.from_array(np.asarray(values), name))
        return name

    def scalar(self, name: str, value: float) -> str:
        """Add a named number."""
        return self.constant(name, np.array(value, dtype=np.float32))

    def apply(self, operator: str, *inputs: str, output: str = "", **attributes: Any) -> str:
        """Add an operator and name its result."""
        output = output or f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, list(inputs), [output], **attributes))
        return output


def _scan_part(graph: _Graph, observer: Observer) -> list[str]:
    """Pool the scan as `Observer.pool` does, then scale it."""
    clip = graph.scalar("laser_clip", observer.spec.laser_clip_m)
    least = graph.scalar("least_range", observer.least_range)
    # False for NaN too, which then reads as nothing in sight.
    is_valid = graph.apply("GreaterOrEqual", "scan", least)
    readings = graph.apply("Where", is_valid, graph.apply("Min", "scan", clip), clip)
    padding = graph.constant("one_more_beam", np.array([0, 0, 0, 1], dtype=np.int64))
    padded = graph.apply("Pad", readings, padding, clip)
    beams = graph.constant("beams", observer.beams)
    gathered = graph.apply("Gather", padded, beams, axis=1)
    last_axis = graph.constant("last_axis", np.array([2], dtype=np.int64))
    nearest = graph.apply("ReduceMin", gathered, last_axis, keepdims=0)
    centred = graph.apply("Sub", nearest, graph.scalar("half_clip", observer.spec.laser_clip_m / 2))
    return [graph.apply("Div", centred, clip)]


def _encoded_parameters(graph: _Graph, action: ActionSpec) -> str:
    """Scale the parameters in force as `ActionSpec.encode` does."""
    low, high = action.bounds()
    values = "parameters"
    if action.is_log.any():
        graph.constant("has_log_scale", action.is_log)
        positive = graph.apply("Max", values, graph.scalar("least_positive", 1e-12))
        values = graph.apply("Where", "has_log_scale", graph.apply("Log", positive), values)
    graph.constant("parameter_middle", ((low + high) / 2.0).astype(np.float32))
    graph.constant("parameter_half", ((high - low) / 2.0).astype(np.float32))
    centred = graph.apply("Sub", values, "parameter_middle")
    scaled = graph.apply("Div", centred, "parameter_half")
    return graph.apply("Clip", scaled, graph.scalar("least", -1.0), graph.scalar("most", 1.0))


def _perceptron(graph: _Graph, policy: ParameterPolicy, signal: str) -> str:
    last = len(policy.weights) - 1
    for number, (matrix, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        weight = graph.constant(f"weight_{number}", matrix)
        offset = graph.constant(f"bias_{number}", bias)
        signal = graph.apply("Gemm", signal, weight, offset, transB=1)
        signal = graph.apply("Tanh" if number == last else "Relu", signal)
    return signal


def _decoded_action(graph: _Graph, signal: str, action: ActionSpec) -> None:
    """Map the action to its bounds as `ActionSpec.decode` does."""
    low, high = action.bounds()
    graph.constant("action_half", ((high - low) / 2.0).astype(np.float32))
    graph.constant("action_middle", ((high + low) / 2.0).astype(np.float32))
    scaled = graph.apply("Mul", signal, "action_half")
    if not action.is_log.any():
        graph.apply("Add", scaled, "action_middle", output="next_parameters")
        return
    graph.constant("sets_log_scale", action.is_log)
    values = graph.apply("Add", scaled, "action_middle")
    powers = graph.apply("Exp", values)
    graph.apply("Where", "sets_log_scale", powers, values, output="next_parameters")


def _value(name: str, width: int) -> ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", width])
