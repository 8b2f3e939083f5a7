"""The paper's figures. Every function returns a figure; colours are Okabe and Ito's."""

from collections import Counter

import matplotlib

matplotlib.use("Agg")
import numpy as np  # noqa: E402
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.ticker import (FuncFormatter, LogLocator, MaxNLocator,  # noqa: E402,F401
                               NullFormatter)

from .runs import Run  # noqa: E402
from .scores import UNREACHABLE, Scores, area_under_roc, average_precision, roc  # noqa: E402

BLUE, ORANGE, GREEN, PURPLE, SKY, RED, YELLOW, BLACK = (
    "#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#B8A800", "#000000")
COLORS = (BLUE, RED, GREEN, ORANGE, PURPLE, SKY, BLACK, YELLOW, "#999999")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<")

plt.rcParams.update({
    "figure.dpi": 110, "font.size": 10, "axes.spines.top": False, "axes.spines.right": False,
    "axes.grid": True, "grid.alpha": 0.3, "legend.frameon": False, "axes.titlesize": 11,
    "figure.constrained_layout.use": True, "svg.fonttype": "none"})


def score_densities(all_scores: list[Scores]) -> Figure:
    """Densities (above) and cumulative distributions (below) of edges and non-edges."""
    figure, axes = plt.subplots(2, len(all_scores), figsize=(3.1 * len(all_scores), 5),
                                squeeze=False)
    for column, scores in enumerate(all_scores):
        # Distances read from left to right. Scores of lists, 0 where nothing is listed, differ by
        # orders of magnitude.
        axis = scores.axis
        if "distance" in axis:
            edges, non_edges = -scores.edges, -scores.non_edges
        else:
            least = min(s[s > 0].min(initial=1) for s in (scores.edges, scores.non_edges))
            edges, non_edges = (np.log10(np.maximum(s, least))
                                for s in (scores.edges, scores.non_edges))
            axis += ", logarithm to base 10"
        both = np.concatenate([edges, non_edges])
        low, high = np.quantile(both, 0.0005), np.quantile(both, 0.9995)
        high = max(high, np.quantile(edges, 0.98))
        low = min(low, np.quantile(edges, 0.02))
        bins = np.linspace(low, high, 80)
        for values, color, label in ((edges, BLUE, "edges"), (non_edges, RED, "non-edges")):
            values = np.clip(values, low, high)
            axes[0, column].hist(values, bins, density=True, histtype="stepfilled", alpha=0.35,
                                 color=color)
            axes[0, column].hist(values, bins, density=True, histtype="step", color=color,
                                 label=label)
            ordered = np.sort(values)
            axes[1, column].plot(ordered, np.arange(1, len(ordered) + 1) / len(ordered),
                                 color=color, label=label)
        axes[0, column].set_title(scores.name)
        axes[0, column].set_yticks([])
        axes[1, column].set_xlabel(axis)
        axes[1, column].set_ylim(0, 1)
    axes[0, 0].set_ylabel("density")
    axes[1, 0].set_ylabel("fraction of pairs")
    axes[0, 0].legend(loc="upper left", fontsize=9)
    return figure


def roc_curves(all_scores: list[Scores]) -> Figure:
    """The whole curve, and its beginning on a logarithmic axis, where retrieval happens."""
    figure, (whole, beginning) = plt.subplots(1, 2, figsize=(10, 4.4))
    for scores, color in zip(all_scores, COLORS):
        false, true = roc(scores)
        label = (f"{scores.name}: area {area_under_roc(scores):.4f}, "
                 f"average precision {average_precision(scores):.3f}")
        whole.plot(false, true, color=color, label=label)
        beginning.semilogx(np.maximum(false, 1e-6), true, color=color)
    whole.plot([0, 1], [0, 1], color="0.7", linestyle=":")
    whole.legend(loc="lower right", fontsize=9)
    for axes in (whole, beginning):
        axes.set_ylabel("edges ranked before (true positive rate)")
        axes.set_ylim(0, 1.005)
    whole.set_xlabel("non-edges ranked before (false positive rate)")
    beginning.set_xlabel("the same, logarithmic")
    beginning.set_xlim(1e-5, 1)
    return figure


def graph_distances(edges: Counter, non_edges: Counter) -> Figure:
    """How far apart the images of edges and non-edges are in the graph without the edge."""
    longest = max((d for d in (*edges, *non_edges) if d != UNREACHABLE), default=2)
    longest = min(longest, 9)
    labels = [str(d) for d in range(2, longest)] + [f"{longest}+", "none"]

    def shares(counts: Counter) -> np.ndarray:
        total = sum(counts.values())
        near = [counts[d] for d in range(2, longest)]
        far = sum(n for d, n in counts.items() if longest <= d < UNREACHABLE)
        return np.array([*near, far, counts[UNREACHABLE]]) / total

    figure, (mass, cumulative) = plt.subplots(1, 2, figsize=(10, 3.8))
    places = np.arange(len(labels))
    for offset, counts, color, label in ((-0.2, edges, BLUE, "edges"),
                                         (0.2, non_edges, RED, "non-edges")):
        share = shares(counts)
        bars = mass.bar(places + offset, share, 0.4, color=color, label=label)
        mass.bar_label(bars, [f"{s:.3f}" if s >= 0.0005 else "" for s in share], fontsize=7)
        cumulative.step(places, np.cumsum(share), where="mid", color=color, label=label,
                        marker="o", markersize=3)
    for axes in (mass, cumulative):
        axes.set_xticks(places, labels)
        axes.set_xlabel("modified graph distance (none: not connected otherwise)")
    mass.set_ylabel("fraction of pairs")
    cumulative.set_ylabel("cumulative fraction")
    cumulative.set_ylim(0, 1.02)
    mass.legend()
    return figure


def discovery(runs: dict[str, Run], num_edges: int, over: str) -> Figure:
    """The fraction of all edges found, over tests or over time."""
    figure, axes = plt.subplots(figsize=(12, 5))
    for (label, run), color in zip(runs.items(), COLORS):
        found = np.append(0, np.cumsum(run.is_edge)) / num_edges
        x = (np.arange(len(found)) if over == "tests"
             else np.append(run.preprocessing, run.seconds))
        axes.plot(x, found, color=color, label=f"{label} ({found[-1]:.3f})")
        axes.plot(x[-1:], found[-1:], marker="o", color=color, markersize=4)
    if over == "time":  # Pre-processing takes from seconds to an hour.
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,g}"))
    axes.set_xlabel("pairs tested" if over == "tests" else
                    "seconds (logarithmic): pre-processing as measured, then matching and verification")
    axes.set_ylabel("fraction of the exhaustive edges found")
    axes.set_ylim(0, 1.01)
    if over == "tests":
        axes.set_xlim(0)
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), title="system (at its end)")
    return figure


def recall_curves(families: dict[str, list[tuple[str, int, float]]], num_edges: int) -> Figure:
    """Recall over tests for every budget: (label of the budget, tests, recall)."""
    figure, (whole, end) = plt.subplots(1, 2, figsize=(13, 5.5))
    least = 0.5 / num_edges  # What a complete curve is drawn at.
    for (label, points), color, marker in zip(families.items(), COLORS, MARKERS):
        points = sorted(points, key=lambda point: point[1])
        tests = np.array([point[1] for point in points])
        recall = np.array([point[2] for point in points])
        style = {"marker": marker if len(points) < 30 else "", "markersize": 4, "linewidth": 1.3,
                 "color": color, "linestyle": "-" if len(points) < 30 else "--"}
        whole.plot(tests, recall, label=label, **style)
        end.plot(tests, np.maximum(1 - recall, least), **style)
    for axes in (whole, end):
        axes.set_xscale("log")
        axes.axvline(num_edges, color="0.6", linestyle=":")
        axes.set_xlabel("pairs tested (dotted: as many as there are edges)")
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.0f}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    whole.set_ylabel("fraction of the exhaustive edges found")
    whole.set_ylim(0, 1.01)
    whole.legend(loc="lower right")
    end.set_xlim(num_edges)
    end.set_yscale("log")
    end.set_ylim(least, 0.5)
    end.set_ylabel("fraction missed (logarithmic; lower is better)")
    return figure


def stages(report: dict) -> Figure:
    """What sampling and propagation tested and found, by iteration."""
    iterations = report["iterations"]
    figure, (tests, edges) = plt.subplots(1, 2, figsize=(10, 3.6))
    places = np.array([i["iteration"] + 1 for i in iterations])
    for axes, key, title in ((tests, "tested", "pairs tested"), (edges, "edges", "edges found")):
        sampling = np.array([i["sampling"][key] for i in iterations])
        propagation = np.array([i["propagation"][key] for i in iterations])
        axes.bar(places, sampling, color=BLUE, label="sampling")
        axes.bar(places, propagation, bottom=sampling, color=ORANGE, label="propagation")
        axes.set_xlabel("iteration")
        axes.set_xticks(places)
        axes.set_title(title)
    tests.legend()
    return figure


def registered_images(counts: list[tuple[str, int]]) -> Figure:
    figure, axes = plt.subplots(figsize=(8, 0.45 * len(counts) + 1))
    labels = [label for label, _ in counts][::-1]
    values = [value for _, value in counts][::-1]
    bars = axes.barh(labels, values, color=BLUE, height=0.6)
    axes.bar_label(bars, padding=3)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("images registered by colmap mapper, all models together")
    axes.set_xlim(0, 1.08 * max(values))
    return figure
