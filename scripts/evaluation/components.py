"""Connected components of a matching graph."""

from .truth import Truth


def component_sizes(truth: Truth) -> list[int]:
    """Of those with two images or more, the largest first."""
    neighbors = truth.adjacency()
    seen: set[int] = set()
    sizes = []
    for start in range(len(truth.names)):
        if start in seen or not neighbors[start]:
            continue
        component, queue = {start}, [start]
        while queue:
            for other in neighbors[queue.pop()] - component:
                component.add(other)
                queue.append(other)
        seen |= component
        sizes.append(len(component))
    return sorted(sizes, reverse=True)
