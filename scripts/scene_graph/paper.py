"""The nine rows of the paper (GraphMatch, 3DV 2017, tables 1 and 2)."""

from dataclasses import dataclass


@dataclass
class PaperScene:
    name: str
    num_images: int
    baseline_edges: int | None  # Of exhaustive matching, where the paper has it.
    tree: tuple[int, int]  # Pairs tested and matched.
    briad: tuple[int, int]
    sampling: tuple[int, int]
    propagation: tuple[int, int]

    @property
    def overall(self) -> tuple[int, int]:
        return (self.sampling[0] + self.propagation[0], self.sampling[1] + self.propagation[1])

    @property
    def num_edges(self) -> int:
        """Without a baseline: as if GraphMatch had found as large a part as elsewhere (0.87)."""
        return self.baseline_edges or round(self.overall[1] / 0.87)

    @property
    def max_tests(self) -> int:
        """The tests of an image by sampling, MaxTestsForSampling."""
        return int(max(min(0.017 * self.num_images, 120), 10))

    def drawn(self) -> int:
        """What all images draw if none is full: the tests before pairs are united."""
        return self.num_images * 10 * (self.max_tests // 10)


SCENES = [
    PaperScene("Taj Mahal", 1497, 63474, (110996, 9368), (102286, 21332), (17486, 2378),
               (101799, 46571)),
    PaperScene("Montreal N.D.", 2298, 33836, (175512, 18060), (110343, 8241), (42419, 4145),
               (86282, 27823)),
    PaperScene("Roman Forum", 2364, 52155, (182358, 15795), (197374, 26730), (43886, 3686),
               (152874, 46530)),
    PaperScene("NYC Library", 2550, 15241, (197050, 7639), (111135, 4327), (65874, 2726),
               (37569, 10701)),
    PaperScene("Alamo", 2915, 62793, (223907, 19932), (142557, 12490), (81484, 3787),
               (99510, 47156)),
    PaperScene("Union Square", 5961, None, (611401, 2580), (230570, 11978), (396075, 4853),
               (51224, 12739)),
    PaperScene("Vienna Cathedral", 6288, None, (633504, 10578), (281635, 17578), (392353, 13852),
               (149515, 65542)),
    PaperScene("Piccadilly", 7351, None, (569594, 28789), (436309, 93785), (460353, 14477),
               (436226, 133838)),
    PaperScene("Trafalgar", 15685, None, (1292365, 46478), (947627, 217338), (1084254, 23960),
               (875221, 319300)),
]
