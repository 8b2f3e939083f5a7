"""The systems of the paper and the options that make graphmatch_matcher each of them."""

from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class System:
    name: str
    label: str
    arguments: list[str]
    inputs: list[Path] = field(default_factory=list)
    exports: str = ""  # The name of the descriptor, if its vectors are to be written.


def strategy(name: str) -> list[str]:
    return ["--GraphMatching.strategy", name]


def retrieval(num_images: int, ranking: list[str]) -> list[str]:
    return strategy("retrieval") + ["--GraphMatching.num_retrieved_images", str(num_images)] + ranking


def briad(num_images: int, ranking: list[str]) -> list[str]:
    return strategy("briad") + ["--GraphMatching.num_retrieved_images", str(num_images)] + ranking


def graphmatch(num_iterations: int, budget: int) -> list[str]:
    return [*strategy("graphmatch"), "--GraphMatching.number_sample_iterations",
            str(num_iterations), "--GraphMatching.max_tests_for_sampling", str(budget)]


def given_vectors(path: Path) -> tuple[list[str], list[Path]]:
    """The options that read vectors from a file, and the files."""
    return (["--GraphMatching.descriptor", "file", "--GraphMatching.vectors_path", str(path)],
            [path, path.with_suffix(".txt")])


FISHER = ["--GraphMatching.descriptor", "fisher"]
# Of graphmatch_matcher: visual words.
DEFAULT_DESCRIPTOR: list[str] = []
# The vectors of the paper: 16 components, no PCA. The same 16 means are the centres of VLAD.
PAPER_MIXTURE = ["--GraphMatching.num_components", "16", "--GraphMatching.pca_dim", "0"]
PAPER_FISHER = "Fisher, 16 components"
VLAD = "VLAD, 16 centres"


def descriptors(image_path: Path | None) -> list[tuple[str, str, list[str]]]:
    """(name, label, options) of the vectors that graphmatch_matcher makes."""
    found = [("fisher", "Fisher", FISHER), ("fisher_paper", PAPER_FISHER, FISHER + PAPER_MIXTURE),
             ("vlad", VLAD, ["--GraphMatching.descriptor", "vlad", *PAPER_MIXTURE])]
    if image_path is not None:
        found.append(("gist", "GIST", ["--GraphMatching.descriptor", "gist", "--image_path",
                                       str(image_path)]))
    return found


def main_systems(tree_lists: Path | None, image_path: Path | None,
                 vectors_path: Path | None) -> list[System]:
    """Those of the efficiency table, with the paper's parameters."""
    systems = [System("exhaustive", "Exhaustive", strategy("exhaustive"))]
    if tree_lists is not None:
        tree = ["--GraphMatching.ranking_path", str(tree_lists)]
        systems += [
            System("tree", "Vocabulary tree, k = 120", retrieval(120, tree), [tree_lists]),
            System("tree_briad", "BRIAD on the tree, k = 40", briad(40, tree), [tree_lists]),
        ]
    systems += [
        System("retrieval", "Retrieval (Fisher), k = 120", retrieval(120, FISHER)),
        System("briad", "BRIAD (Fisher), k = 40", briad(40, FISHER)),
        System("sampling", "Sampling alone", strategy("sampling") + FISHER),
        System("propagation", "Propagation after one sampling", strategy("propagation") + FISHER),
    ]
    loop = strategy("graphmatch")
    systems += [System("graphmatch" if name == "fisher" else f"graphmatch_{name}",
                       f"GraphMatch ({label})", loop + options, exports=name)
                for name, label, options in descriptors(image_path)]
    systems += [
        System("retrieval_asmk", "Retrieval (asmk), k = 120", retrieval(120, DEFAULT_DESCRIPTOR)),
        System("briad_asmk", "BRIAD (asmk), k = 40", briad(40, DEFAULT_DESCRIPTOR)),
        System("graphmatch_asmk", "GraphMatch (asmk)", loop),
        System("best_first_fisher", "Best first (Fisher)", FISHER),
        System("best_first", "Best first (asmk)", []),
    ]
    if vectors_path is not None:
        systems.append(System("graphmatch_file", f"GraphMatch ({vectors_path.stem})",
                              loop + given_vectors(vectors_path)[0],
                              given_vectors(vectors_path)[1]))
    return systems


# What is tried for the curves of recall over tests.
NUM_RETRIEVED = (1, 2, 3, 5, 7, 10, 14, 20, 28, 40, 60, 80, 120)
GRAPHMATCH_BUDGETS = ((1, 1), (2, 2), (3, 3), (5, 5), (7, 7), (10, 10), (10, 20), (10, 40),
                      (10, 80), (10, 120))


def curves(fisher: Path, tree_lists: Path | None) -> dict[str, list[System]]:
    """By label: the same system with other budgets. fisher: the vectors, so that they are not made
    again for every point."""
    vectors, inputs = given_vectors(fisher)

    def of_budgets(name: str, arguments: list[str], files: list[Path]) -> list[System]:
        return [System(f"curve_{name}_{i}_{b}", f"{i} x {b // i}", graphmatch(i, b) + arguments, files)
                for i, b in GRAPHMATCH_BUDGETS]

    def of_k(name: str, make, arguments: list[str], files: list[Path]) -> list[System]:
        return [System(f"curve_{name}_{k}", f"k = {k}", make(k, arguments), files)
                for k in NUM_RETRIEVED]

    families = {
        "GraphMatch (asmk)": of_budgets("asmk", DEFAULT_DESCRIPTOR, []),
        "GraphMatch (Fisher)": of_budgets("graphmatch", vectors, inputs),
        "BRIAD (asmk)": of_k("briad_asmk", briad, DEFAULT_DESCRIPTOR, []),
        "BRIAD (Fisher)": of_k("briad", briad, vectors, inputs),
        "Retrieval (asmk)": of_k("retrieval_asmk", retrieval, DEFAULT_DESCRIPTOR, []),
        "Retrieval (Fisher)": of_k("retrieval", retrieval, vectors, inputs),
    }
    if tree_lists is not None:
        tree = ["--GraphMatching.ranking_path", str(tree_lists)]
        families["GraphMatch on the tree's lists"] = of_budgets("tree_graphmatch", tree,
                                                                [tree_lists])
        families["BRIAD on the tree"] = of_k("tree_briad", briad, tree, [tree_lists])
        families["Vocabulary tree"] = of_k("tree", retrieval, tree, [tree_lists])
    return families
