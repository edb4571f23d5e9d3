"""Reads a serial arm's joints and collision cylinders off its URDF, as the viewer draws them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple
from xml.etree import ElementTree

from drivers.interface.geometry import SE3


class Cylinder(NamedTuple):
    """A solid cylinder about the z axis of its own frame."""

    link_from_cylinder: SE3
    radius_m: float
    length_m: float


@dataclass(frozen=True, slots=True)
class Link:
    """A link, and the joint at its beginning, which turns it about the link's own z axis."""

    name: str
    parent_from_joint: SE3
    turns: bool  # False: fixed to its parent
    cylinders: tuple[Cylinder, ...]


def links_of(urdf: str) -> tuple[Link, ...]:
    """Return the links of a serial arm from its foot to its flange.

    Raises:
        ValueError: it is no chain of fixed and revolute joints about z.
    """
    robot = ElementTree.fromstring(urdf)
    joints = {_attribute(joint, "parent", "link"): joint for joint in robot.findall("joint")}
    bodies = {body.attrib["name"]: body for body in robot.findall("link")}
    children = {_attribute(joint, "child", "link") for joint in joints.values()}
    feet = [name for name in bodies if name not in children]
    if len(feet) != 1 or len(joints) != len(bodies) - 1:
        raise ValueError(f"an arm is one chain of links, not {len(bodies)} links with {len(feet)} beginnings")
    links = [Link(feet[0], SE3(), False, _cylinders(bodies[feet[0]]))]
    while (joint := joints.get(links[-1].name)) is not None:
        name = _attribute(joint, "child", "link")
        links.append(Link(name, _origin(joint), _turns(joint), _cylinders(bodies[name])))
    return tuple(links)


def _turns(joint: ElementTree.Element) -> bool:
    if joint.attrib["type"] == "fixed":
        return False
    axis = joint.find("axis")
    if joint.attrib["type"] != "revolute" or axis is None or _numbers(axis.attrib["xyz"]) != (0.0, 0.0, 1.0):
        raise ValueError(f"joint {joint.attrib['name']} does not turn about z")
    return True


def _cylinders(body: ElementTree.Element) -> tuple[Cylinder, ...]:
    found = []
    for collision in body.findall("collision"):
        shape = collision.find("geometry/cylinder")
        if shape is not None:
            found.append(Cylinder(_origin(collision), float(shape.attrib["radius"]), float(shape.attrib["length"])))
    return tuple(found)


def _origin(element: ElementTree.Element) -> SE3:
    origin = element.find("origin")
    if origin is None:
        return SE3()
    x, y, z = _numbers(origin.attrib.get("xyz", "0 0 0"))
    roll, pitch, yaw = _numbers(origin.attrib.get("rpy", "0 0 0"))
    return SE3.from_euler(x, y, z, roll, pitch, yaw)


def _numbers(text: str) -> tuple[float, float, float]:
    x, y, z = (float(word) for word in text.split())
    return x, y, z


def _attribute(element: ElementTree.Element, child: str, name: str) -> str:
    found = element.find(child)
    if found is None:
        raise ValueError(f"joint {element.attrib['name']} has no {child}")
    return found.attrib[name]
