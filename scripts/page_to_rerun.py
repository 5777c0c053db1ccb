#!/usr/bin/env python3
"""Turns a page of `replay --html` into a recording for the Rerun viewer.

    pip install rerun-sdk==0.36.3
    python3 scripts/page_to_rerun.py both.html both.rrd
    rerun both.rrd

The wheel brings the viewer of the same version. Shapes, poses, forces and curves are those of the
page; times are seconds since the reset.
"""

import base64
import json
import re
import sys

import numpy
import rerun as rr
import rerun.blueprint as rrb

# As in the page: a semi-axis (m) for each factor of ten above the softest stiffness (N/m), colours.
PER_DECADE, SOFTEST, SMALLEST = 0.05, 30, 0.003
SCENE = "scene"
PENS = [0x4AA8E8FF, 0xF08A3CFF, 0x2CC295FF, 0xDD8FC4FF, 0xE9B949FF, 0x8FD0F5FF, 0xB98D63FF, 0xE4E7EBFF]
FORCE_COLOR, STIFFNESS_COLOR = [214, 0, 140], [40, 120, 200, 90]


def floats(text, columns=1):
    return numpy.frombuffer(base64.b64decode(text), dtype="<f4").reshape(-1, columns)


def read(path):
    """The episodes of a page."""
    with open(path, encoding="utf-8") as file:
        data = re.search(r'<script id="data" type="application/json">(.*?)</script>', file.read(), re.DOTALL)
    if data is None:
        sys.exit(f"{path}: not a page of replay --html")
    return json.loads(data[1])["episodes"]


def shape(solid):
    """A solid in the frame of its body."""
    position, [w, *xyz] = numpy.array(solid["pose"][:3]), solid["pose"][3:]
    style = {"quaternions": [[*xyz, w]], "colors": [solid["color"]], "fill_mode": "solid"}
    if solid["kind"] == "box":
        return rr.Boxes3D(half_sizes=[solid["size"]], centers=[position], **style)
    if solid["kind"] == "sphere":
        return rr.Ellipsoids3D(half_sizes=[solid["size"] * 3], centers=[position], **style)
    if solid["kind"] == "triangles":
        corners = numpy.array(solid["size"]).reshape(-1, 3)
        turned = corners + 2 * numpy.cross(xyz, numpy.cross(xyz, corners) + w * corners)
        faces = numpy.arange(len(corners)).reshape(-1, 3)
        return rr.Mesh3D(vertex_positions=position + turned, triangle_indices=faces, albedo_factor=solid["color"])
    half, radius = solid["size"]
    if solid["kind"] == "cylinder":
        return rr.Cylinders3D(lengths=[2 * half], radii=[radius], centers=[position], **style)
    # Rerun's capsules begin at their origin.
    x, y, z = xyz
    axis = numpy.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    return rr.Capsules3D(lengths=[2 * half], radii=[radius], translations=[position - half * axis], **style)


def record(episode, name):
    """Logs an episode below the entity `name`."""
    times = numpy.arange(1, episode["frames"] + 1) / episode["rate"]

    def log(parts, thing, **when):
        rr.log(rr.new_entity_path([name, *parts]), thing, **when)

    def over_time(parts, columns):
        clock = rr.TimeColumn("time", duration=times)
        rr.send_columns(rr.new_entity_path([name, *parts]), indexes=[clock], columns=columns)

    log([SCENE], rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    poses = floats(episode["poses"], 7).reshape(len(times), episode["bodies"], 7)
    for body in range(episode["bodies"]):
        position, quaternion = poses[:, body, :3], poses[:, body, [4, 5, 6, 3]]
        over_time([SCENE, f"body {body}"], rr.Transform3D.columns(translation=position, quaternion=quaternion))
    for index, solid in enumerate(episode["solids"]):
        carrier = "world" if solid["body"] is None else f"body {solid['body']}"
        log([SCENE, carrier, f"solid {index}"], shape(solid), static=True)
    for index, decal in enumerate(episode["decals"]):
        disc = {"lengths": [0.001], "radii": [decal["radius"]], "centers": [decal["centre"]], "fill_mode": "solid"}
        for frame, color in decal["colors"]:
            rr.set_time("time", duration=times[frame])
            # A decal without a colour is hidden from then on.
            drawn = rr.Clear(recursive=False) if color is None else rr.Cylinders3D(colors=[color], **disc)
            log([SCENE, "decals", str(index)], drawn)

    tool, force = floats(episode["tool"], 3), floats(episode["force"], 3)
    log([SCENE, "force"], rr.Arrows3D.from_fields(colors=[FORCE_COLOR], radii=[0.006]), static=True)
    over_time([SCENE, "force"], rr.Arrows3D.columns(origins=tool, vectors=force * episode["metresPerNewton"]))
    glass = rr.Ellipsoids3D.from_fields(colors=[STIFFNESS_COLOR], fill_mode="solid")
    log([SCENE, "stiffness"], glass, static=True)
    decades = numpy.log10(numpy.maximum(floats(episode["stiffness"], 3), SOFTEST) / SOFTEST)
    semi_axes = numpy.maximum(PER_DECADE * decades, SMALLEST)
    over_time([SCENE, "stiffness"], rr.Ellipsoids3D.columns(centers=tool, half_sizes=semi_axes))
    for panel in episode["panels"]:
        for series, color in zip(panel["series"], PENS):
            curve = [panel["title"], series["label"]]
            log(curve, rr.SeriesLines.from_fields(colors=[color]), static=True)
            over_time(curve, rr.Scalars.columns(scalars=floats(series["values"])[:, 0]))


def layout(names, episodes):
    """The scenes side by side, below each its curves, a tab for every quantity."""

    def curves(name, panels):
        titles = [panel["title"] for panel in panels]
        return [rrb.TimeSeriesView(origin=rr.new_entity_path([name, title]), name=title) for title in titles]

    def column(name, episode):
        camera = episode["cameras"][0]
        eye = rrb.EyeControls3D(position=camera["eye"], look_target=camera["target"], eye_up=[0, 0, 1])
        scene = rrb.Spatial3DView(origin=rr.new_entity_path([name, SCENE]), name=name, eye_controls=eye)
        return rrb.Vertical(scene, rrb.Tabs(*curves(name, episode["panels"])), row_shares=[3, 2])

    return rrb.Blueprint(rrb.Horizontal(*map(column, names, episodes)))


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    page, recording = sys.argv[1:]
    episodes = read(page)
    names = [f"{index + 1}: {episode['title']}" for index, episode in enumerate(episodes)]
    rr.init("replay")
    rr.save(recording, default_blueprint=layout(names, episodes))
    for episode, name in zip(episodes, names, strict=True):
        record(episode, name)


main()
