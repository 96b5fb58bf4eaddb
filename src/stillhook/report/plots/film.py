"""A film of a lift to scale, seen along the ship: hull, crane, wire, payload, waves and seabed, controllers side by
side, above the speed of the payload and the tension of its slings. MP4 where ffmpeg is found, else a page that plays.
"""

from __future__ import annotations

import base64
import io
import json
import math
import re
from collections.abc import Iterator, Mapping
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_file
from stillhook.formats.lift_file import LiftFile
from stillhook.physics.scalar import G
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY, colours_of
from stillhook.report.plots.moments import Bounds, TimeSegment, draw, time_segments
from stillhook.report.plots.run import STEEL
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import WinchMode

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MP4, PAGE = "lowering.mp4", "lowering.html"
TEMPLATE = "film.html"
FRAMES_PER_SECOND, FRAMES = 10, 150
"""Of each stretch; one that is longer than fifteen seconds is shown faster than it was."""
DOTS = 80
"""Dots per inch."""
SCENE, COLUMN, TRACES, EDGE = 5.6, (2.6, 5.4), 2.0, 0.9
"""Height of the scene, least and largest width of a column, height of the curves below, room at the left [inch]."""
FREEBOARD, PEDESTAL, MARGIN = 4.0, 9.0, 5.0
"""Height of the deck over the water and of the crane's foot over the deck, room around what is drawn [m]."""
SURFACE = "#3B7EA1"
COMPENSATED = 30.0
"""Length of a phase in heave compensation that is filmed, where the payload neither passes the surface nor lands [s].
"""
UNKNOWN = "hull not known, breadth and draught assumed"
QUALITY = 85
"""Of the pictures of a page (WebP)."""


class Hull(NamedTuple):
    """Section of the ship at the crane [m]: breadth, draught, and the tip from the centre line, to port; words where
    they are assumed."""

    breadth: float
    draught: float
    y_tip: float
    words: str = ""


def hull_of(file: LiftFile) -> Hull:
    """The ship of a lift file: breadth and draught by the notes of its vessel file, else assumed."""
    y = -20.0 if file.at is None else file.at.y
    text = "; ".join(() if file.vessel is None else file.vessel.notes)
    found = [re.search(rf"{word} ([0-9.]+) m\b", text) for word in ("breadth", "draught")]
    if all(found):
        breadth, draught = (float(each[1]) for each in found if each is not None)
        return Hull(breadth, draught, y)
    breadth = max(10.0, 2.0 * (abs(y) - 8.0))
    return Hull(breadth, 0.27 * breadth, y, UNKNOWN)


class Stretch(NamedTuple):
    """A part of the lift as it is filmed: name, instants of its frames [s], how many times as fast it is shown, and
    windows on the scene from the top, all to one scale."""

    name: str
    times: FloatArray
    faster: float
    windows: tuple[Bounds, ...]


class Film:
    """The pictures of a film. runs: by the name of their controller, of one lift in the same waves."""

    def __init__(self, runs: Mapping[str, xarray.Dataset], file: LiftFile, title: str = "") -> None:
        self.runs, self.lift, self.hull = dict(runs), file.lift, hull_of(file)
        self.title = f"{title} ({self.hull.words})" if self.hull.words else title
        self.colours = colours_of(self.runs)
        self.slowness = _slowness(next(iter(self.runs.values())), file)
        run = next(iter(self.runs.values()))
        whole = TimeSegment("the lift", 0, run.sizes["time"] - 1)
        parts = sorted([*time_segments(run, self.lift), *compensated(run, self.lift)], key=lambda part: part.first)
        self.stretches = [self._stretch(run, each) for each in parts or [whole]]

    @property
    def n_frames(self) -> int:
        """Pictures in all."""
        return sum(len(each.times) for each in self.stretches)

    def _stretch(self, run: xarray.Dataset, part: TimeSegment) -> Stretch:
        t = run["time"].values
        first, last = float(t[part.first]), float(t[part.last])
        frames = max(2, min(FRAMES, round((last - first) * FRAMES_PER_SECOND)))
        times = np.linspace(first, last, frames)
        faster = max(1.0, (last - first) * FRAMES_PER_SECOND / frames)
        return Stretch(part.name, times, faster, self._windows(first, last))

    def _windows(self, first: float, last: float) -> tuple[Bounds, ...]:
        """The ship from the tip down to the payload; and the seabed, where the payload is near it and that is not seen
        in the first."""
        lift, hull = self.lift, self.hull
        z = np.concatenate([r["z_load"].sel(time=slice(first, last)).values for r in self.runs.values()])
        top, under = lift.h_tip + MARGIN, -hull.draught - MARGIN
        size = lift.payload.height + lift.rigging.height
        size += 0.0 if lift.compensator is None else lift.compensator.shortest + lift.compensator.travel
        near = float(z.max()) + size > under
        low = min(under, float(z.min()) - MARGIN) if near else under
        beam, reach = 0.5 * hull.breadth, abs(hull.y_tip)
        side = 0.75 * math.sqrt(lift.payload.covered(lift.rho).A_p) + MARGIN
        left, right = (reach + beam + 2.0, side) if hull.y_tip < 0.0 else (side, reach + beam + 2.0)
        if -lift.depth + MARGIN > low:
            return (Bounds(-lift.depth - 3.0, top, left, right),)
        upper = Bounds(low, top, left, right)
        if near:
            return (upper,)
        return upper, Bounds(float(z.min()) - 4.0, float(z.max()) + size + 2.0, left, right)

    def frames(self, figure: Figure) -> Iterator[None]:
        """Draw one picture after the other into this figure."""
        for stretch in self.stretches:
            scenes, marks = self._lay_out(figure, stretch)
            for t in stretch.times:
                self._show(scenes, stretch, float(t))
                for mark in marks:
                    mark.set_xdata([float(t)] * 2)
                yield

    def canvas(self) -> Figure:
        """An empty figure that holds every stretch."""
        sizes = [self._size(each) for each in self.stretches]
        figure = kit.canvas(max(w for w, _ in sizes), SCENE + TRACES + 1.6)
        figure.set_layout_engine("none")
        figure.set_dpi(DOTS)
        return figure

    def _size(self, stretch: Stretch) -> tuple[float, float]:
        """Width of the figure, and metres an inch [m]."""
        tall = sum(each.high - each.low for each in stretch.windows)
        wide = stretch.windows[0].left + stretch.windows[0].right
        scale = max(tall / (SCENE - 0.25 * (len(stretch.windows) - 1)), wide / COLUMN[1])
        return EDGE + len(self.runs) * (max(wide / scale, COLUMN[0]) + 0.4), scale

    def _lay_out(self, figure: Figure, stretch: Stretch) -> tuple[list[list[Axes]], list[Any]]:
        """Axes of the windows of each run, all at one scale, and marks of the time in the curves below."""
        figure.clear()
        figure.suptitle(f"{self.title}: {stretch.name}, {stretch.faster:.1f} times as fast", fontsize="medium")
        width, height = figure.get_size_inches()
        scale, n = self._size(stretch)[1], len(self.runs)
        room, scenes = (width - EDGE) / n, []
        for k in range(n):
            column, y = [], height - 0.75
            for window in stretch.windows:
                w, h = (window.left + window.right) / scale, (window.high - window.low) / scale
                y -= h
                x = EDGE + k * room + 0.5 * (room - 0.4 - w)
                column.append(figure.add_axes((x / width, y / height, w / width, h / height)))
                y -= 0.25
            if len(stretch.windows) > 1:
                hidden = stretch.windows[0].low - stretch.windows[1].high
                figure.text(
                    (x + 0.5 * w) / width,
                    column[1].get_position().y1 + 0.11 / height,
                    f"{hidden:.0f} m not drawn",
                    fontsize="x-small",
                    color=GREY,
                    ha="center",
                    va="center",
                )
            scenes.append(column)
        return scenes, self._traces(figure, stretch)

    def _traces(self, figure: Figure, stretch: Stretch) -> list[Any]:
        width, height = figure.get_size_inches()
        part, marks = slice(stretch.times[0], stretch.times[-1]), []
        panels = (("v_load", "", "speed of the payload\n[m/s], up positive"), ("F_sling", "force", "slings [kN]"))
        for k, (name, kind, label) in enumerate(panels):
            x = EDGE + 0.5 * k * width
            ax = figure.add_axes(
                (x / width, 0.5 / height, (0.5 * width - EDGE - 0.2) / width, (TRACES - 0.45) / height)
            )
            for controller, run in self.runs.items():
                cut = run.sel(time=part)
                every = slice(None, None, max(1, cut.sizes["time"] // 1500))
                y = kit.display(cut[name].values[every], kind)
                ax.plot(cut["time"].values[every], y, lw=1.0, color=self.colours[controller], label=controller.upper())
            ax.grid(alpha=0.3)
            ax.tick_params(labelsize="small")
            kit.axis(ax, "time [s]", label, size="small")
            marks.append(ax.axvline(stretch.times[0], color=GREY, lw=1.0))
        kit.legend(figure.axes[-1], "upper right", ncols=len(self.runs))
        return marks

    def _show(self, scenes: list[list[Axes]], stretch: Stretch, t: float) -> None:
        for (controller, run), column in zip(self.runs.items(), scenes, strict=True):
            i = min(int(np.searchsorted(run["time"].values, t)), run.sizes["time"] - 1)
            for k, (ax, window) in enumerate(zip(column, stretch.windows, strict=True)):
                ax.clear()
                u = np.linspace(-window.left, window.right, 80)
                eta = np.interp(t + self.slowness * u, run["time"].values, run["eta"].values)
                tip = self.lift.h_tip + float(run["s_tip"][i])
                draw(ax, run, self.lift, i, window, tip=tip, water=(u, eta))
                if k == 0:
                    self._ship(ax, float(run["s_tip"][i]))
                    ended = "" if t <= float(run["time"][-1]) else " (ended)"
                    kit.axis(ax, title=f"{controller.upper()}{ended}: {t:.1f} s", size="small")
                ax.plot(u, np.clip(eta, window.low, window.high), color=SURFACE, lw=1.2)
                ax.tick_params(labelsize="x-small")
        scenes[0][0].set_ylabel("height above still water [m]", fontsize="small")

    def _ship(self, ax: Axes, rise: float) -> None:
        """Section of the hull and the crane, which move as the tip does."""
        from matplotlib.patches import Polygon

        hull, side = self.hull, math.copysign(1.0, self.hull.y_tip)
        beam, middle = 0.5 * hull.breadth, hull.y_tip  # the payload is at 0, port to the left
        keel, deck = rise - hull.draught, rise + FREEBOARD
        bilge = 0.15 * hull.breadth
        x = [-beam, beam, beam, beam - bilge, bilge - beam, -beam]
        z = [deck, deck, keel + bilge, keel, keel, keel + bilge]
        points = [(middle + a, b) for a, b in zip(x, z, strict=True)]
        ax.add_patch(Polygon(points, facecolor="#8C97A1", edgecolor="black", lw=0.8, zorder=3))
        foot = middle - side * max(0.0, beam - 4.0)  # y to port is drawn to the left
        head = deck + PEDESTAL
        ax.plot([foot, foot], [deck, head], color=STEEL, lw=5.0, solid_capstyle="butt", zorder=4)
        ax.plot([foot, 0.0], [head, rise + self.lift.h_tip], color=COLOURS[4], lw=3.0, zorder=4)


def compensated(run: xarray.Dataset, lift: Lowering) -> list[TimeSegment]:
    """The end of the longest phase in heave compensation; none where no phase is."""
    number, ahc = run["phase_number"].values, WinchMode.AHC
    found = [(np.flatnonzero(number == k), each.name) for k, each in enumerate(lift.programme) if each.mode is ahc]
    where, name = max(found, key=lambda each: len(each[0]), default=(np.zeros(0, dtype=int), ""))
    if len(where) < 2:
        return []
    last, t = int(where[-1]), run["time"].values
    first = max(int(where[0]), int(np.searchsorted(t, t[last] - COMPENSATED)))
    return [TimeSegment(name or "heave compensation", first, last)]


def _slowness(run: xarray.Dataset, file: LiftFile) -> float:
    """By how much earlier the waves at the payload are those a metre to the right [s/m]: long-crested waves of the mean
    period on deep water; 0 where the direction of the waves is not known."""
    eta, t = run["eta"].values, run["time"].values
    rises = t[1:][(eta[:-1] < 0.0) & (eta[1:] >= 0.0)]
    if file.sea is None or len(rises) < 3:
        return 0.0
    speed = G * float(np.diff(rises).mean()) / (2.0 * math.pi)
    return math.sin(file.sea.trains[0].beta) / speed


def film_name() -> str:
    """Name of the file: MP4 where matplotlib finds ffmpeg, else the page."""
    from matplotlib.animation import FFMpegWriter

    return MP4 if FFMpegWriter.isAvailable() else PAGE


def save_film(film: Film, folder: str | Path) -> Path:
    """Write the film into a folder; the file appears only when it is complete."""
    from matplotlib.animation import FFMpegWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    target = Path(folder) / film_name()
    figure = film.canvas()
    canvas = FigureCanvasAgg(figure)
    with atomic_file(target) as part:
        if target.name == MP4:
            writer = FFMpegWriter(fps=FRAMES_PER_SECOND, extra_args=["-f", "mp4", "-pix_fmt", "yuv420p"])
            with writer.saving(figure, part, DOTS):
                for _ in film.frames(figure):
                    writer.grab_frame()
        else:
            part.write_text(_page(film, figure, canvas), encoding="utf-8")
    return target


def _page(film: Film, figure: Figure, canvas: Any) -> str:
    """A page that plays the film, with its pictures inside."""
    from PIL import Image  # comes with matplotlib

    frames = []
    for _ in film.frames(figure):
        canvas.draw()
        memory = io.BytesIO()
        Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3]).save(memory, "WEBP", quality=QUALITY)
        frames.append(base64.b64encode(memory.getvalue()).decode("ascii"))
    page = (files("stillhook.report.plots") / TEMPLATE).read_text(encoding="utf-8")
    title, rate = escape(film.title), str(FRAMES_PER_SECOND)
    return page.replace("{title}", title).replace("{rate}", rate).replace("{frames}", json.dumps(frames))
