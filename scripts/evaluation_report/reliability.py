"""How often an estimate is right that says how likely it is."""
import math
from typing import Dict, List, Optional, Tuple

from matplotlib.lines import Line2D

from .data import Claim, Results
from .style import Palette, literal, page, plt


def pooled(claims: List[Claim]) -> List[Claim]:
    """The bins of a method over all pairs of groups."""
    bins: Dict[float, List[Claim]] = {}
    for claim in claims:
        bins.setdefault(claim.begin, []).append(claim)
    result = []
    for begin, parts in sorted(bins.items()):
        images = sum(part.images for part in parts)
        if images > 0:
            result.append(Claim(parts[0].method, begin, images,
                                sum(part.images * part.probability for part in parts) / images,
                                sum(part.images * part.not_wrong for part in parts) / images))
    return result


def interval(share: float, count: float) -> Tuple[float, float]:
    """95 % of a share by Wilson (1927), as if all images were independent."""
    z = 1.96
    centre = (share + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return max(0.0, centre - half), min(1.0, centre + half)


def reliability_figure(results: Results, palette: Palette, title: str) -> Optional[plt.Figure]:
    """Share of estimates that are not wrong over the probability around them, a panel for each method."""
    methods = {method: pooled([claim for claim in results.claims if claim.method == method])
               for method in results.methods()}
    methods = {method: bins for method, bins in methods.items() if bins}
    if not methods:
        return None
    handles = [Line2D([], [], color='#7A7A7A', linestyle='--', label='as often as they say'),
               Line2D([], [], color='black', marker='o', label='share that is not wrong, 95 % interval')]
    columns = min(4, len(methods))
    figure, axes = page(title, math.ceil(len(methods) / columns), columns, 2.5, handles)
    for index, (axis, (method, bins)) in enumerate(zip(axes, methods.items())):
        axis.plot([0, 1], [0, 1], color='#7A7A7A', linestyle='--', linewidth=1)
        shares = [bin_.not_wrong for bin_ in bins]
        limits = [interval(bin_.not_wrong, bin_.images) for bin_ in bins]
        errors = [[max(0.0, share - low) for share, (low, _) in zip(shares, limits)],
                  [max(0.0, high - share) for share, (_, high) in zip(shares, limits)]]
        axis.errorbar([bin_.probability for bin_ in bins], shares, yerr=errors, marker='o', markersize=3.5,
                      color=palette.colour(method), linewidth=1.2, elinewidth=.8)
        axis.set(title=literal(method), xlim=(-.02, 1.02), ylim=(-.02, 1.02), xlabel='probability',
                 ylabel='' if index % columns else 'share that is not wrong')
    for axis in axes[len(methods):]:
        axis.set_visible(False)
    return figure
