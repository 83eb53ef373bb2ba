"""Heat maps of the motion grid: ours above the papers'."""
from typing import Dict, List, Optional

from .data import Group, Results
from .experiments import GridPoint, grid_point, group_title
from .papers import Papers
from .style import literal, page, plt

Grid = Dict[GridPoint, float]


def motion_figure(results: Results, papers: Papers, group: Group, title: str) -> Optional[plt.Figure]:
    """Mean error over rotation, acceleration and initial speed ([J] Table 3)."""
    here: Grid = {}
    there: Grid = {}
    for outcome in results.of(group):
        point = grid_point(outcome.method)
        if point:
            for grid, value in ((here, outcome.get('mean_err_m')),
                                (there, papers.lead(results.experiment, group, outcome.method, 'mean_err_m'))):
                if value is not None:
                    grid[point] = value
    if not here:
        return None
    grids = {'here': here, 'papers': there} if there else {'here': here}
    points = [*here, *there]
    rows = sorted({point.acceleration for point in points}, reverse=True)
    columns = sorted({(point.rotation_deg, point.speed) for point in points})
    figure, axes = page(f'{title}, {literal(group_title(group))}', len(grids), 1, .9 + .33 * len(rows))
    for axis, (name, grid) in zip(axes, grids.items()):
        draw_grid(axis, [[grid.get(GridPoint(rotation, acceleration, speed), float('nan'))
                          for rotation, speed in columns] for acceleration in rows])
        axis.set_title(name)
        axis.set_yticks(range(len(rows)))
        axis.set_yticklabels([f'{value:g}' for value in rows])
        axis.set_ylabel(r'$\sigma_{acc}$')
        label_columns(axis, columns)
    return figure


def draw_grid(axis: plt.Axes, cells: List[List[float]]) -> None:
    """Colours each cell by its error and prints it there, the smallest in bold. Each grid has its own scale."""
    known = [value for row in cells for value in row if value == value]
    low, high = min(known), max(known)
    image = axis.imshow(cells, cmap='cividis_r', vmin=low, vmax=high if high > low else low + 1, aspect='auto')
    for row, values in enumerate(cells):
        for column, value in enumerate(values):
            if value == value:
                dark = value > low + .55 * (high - low)
                axis.text(column, row, f'{value:.2f}', ha='center', va='center', fontsize=7.5,
                          color='white' if dark else 'black', fontweight='bold' if value == low else 'normal')
    axis.grid(False)
    axis.tick_params(length=0)
    for spine in axis.spines.values():
        spine.set_visible(False)
    axis.figure.colorbar(image, ax=axis, pad=.01, aspect=12).set_label('mean error [m]')


def label_columns(axis: plt.Axes, columns: List) -> None:
    """The initial speed under each column, the rotation under each block of columns."""
    axis.set_xticks(range(len(columns)))
    axis.set_xticklabels([f'{speed:g}' for _, speed in columns])
    axis.set_xlabel(r'initial speed [multiples of the recorded speed]; below: $\sigma_{rot}$', labelpad=16)
    for rotation in dict.fromkeys(rotation for rotation, _ in columns):
        indices = [index for index, column in enumerate(columns) if column[0] == rotation]
        axis.annotate(f'{rotation:g}°', (sum(indices) / len(indices), 0), xycoords=('data', 'axes fraction'),
                      xytext=(0, -17), textcoords='offset points', ha='center', va='top')
        if indices[0]:
            axis.axvline(indices[0] - .5, color='white', linewidth=2.5)
