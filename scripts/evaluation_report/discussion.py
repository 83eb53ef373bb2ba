"""The discussion of an experiment, whose numbers and comparisons are computed from the tables of its report.

In the YAML file of an experiment, parts of the discussion in braces stand for what the tables say:

{COLUMN | METHODS | GROUPS | FORMAT}          a number as in the table, or "1.2 to 1.9" for several
{COLUMN | A / B | GROUPS | FORMAT}            a ratio; A - B: a difference; A % B: how many per cent A is above B
{COLUMN | A < B | GROUPS ? these words : or these}

COLUMN is a column's name without its unit: `mean error`, `mean error (papers)`, `images until relocalised of 95 %`; of
a group, the first section that has it counts, or the one that is named: `Poses behind a filter: mean error`. METHODS,
A, B and GROUPS are patterns as of file names, several with `;` between them and `!` before exceptions; B may be a
number, and A a ratio or a difference. GROUPS may be left out: all tables. FORMAT is Python's (`.0f`) and may be left
out. A comparison is one of < > <= >= and ~ (they differ by at most 10 %); it must hold for each A and each B in every
group. Groups may be related instead of methods: {COLUMN | METHODS | G / H} is each method's ratio of group G to group H.
Lines may be broken anywhere. Paragraphs with such parts are filled anew, all others stay as they are.
"""
import operator
import re
import textwrap
from fnmatch import fnmatchcase
from typing import Callable, Dict, List, NamedTuple, Optional, Tuple

WIDTH = 120
NO_DATA = '(no data)'
TOLERANCE = 0.10
PART = re.compile(r'\{([^{}]*)\}')
NUMBER = re.compile(r'-?\d+(\.\d+)?(e[-+]?\d+)?')
ITEM = re.compile(r'(?:[-*]|\d+\.) ')


class DiscussionError(ValueError):
    """A part in braces that cannot be understood."""


class Cell(NamedTuple):
    """One number of a table."""
    column: str
    method: str
    group: str
    text: str
    section: str = ''

    @property
    def value(self) -> float:
        """As a number."""
        return float(self.text)


def similar(first: float, second: float) -> bool:
    """Whether two numbers differ by at most a tenth of the larger one."""
    return abs(first - second) <= TOLERANCE * max(abs(first), abs(second))


COMPARISONS: Dict[str, Callable[[float, float], bool]] = {
    '<=': operator.le, '>=': operator.ge, '<': operator.lt, '>': operator.gt, '~': similar}
OPERATIONS: Dict[str, Callable[[float, float], float]] = {
    '/': operator.truediv, '-': operator.sub, '%': lambda first, second: 100 * (first / second - 1)}
DEFAULT_FORMATS = {'/': '.1f', '-': '+.2f', '%': '+.0f'}


def column_names(header: List[str]) -> List[str]:
    """Names of columns without units; a name that comes again is that in relation to the map."""
    names: List[str] = []
    for cell in header:
        name = re.sub(r'\s*\[[^\]]*\]', '', cell).strip()
        if name == 'of 95 % of the runs':
            name = f'{names[-1]} of 95 %'
        if name in names:
            name = f'to the map: {name}'
        names.append(name)
    return names


def cells_of_row(line: str) -> List[str]:
    """The texts between the bars of a line of Markdown."""
    return [cell.strip().replace('\\|', '|') for cell in re.split(r'(?<!\\)\|', line.strip())[1:-1]]


def cells_of(report: str) -> List[Cell]:
    """The first number of each cell of all tables of a report; a table belongs to the headings above it."""
    found: List[Cell] = []
    section, group = '', ''
    names: List[str] = []
    for line in report.splitlines():
        if line.startswith('#'):
            group, names = line.lstrip('#').strip(), []
            section = group if line.startswith('## ') else section
        elif not line.startswith('|'):
            names = []
        elif not names:
            names = column_names(cells_of_row(line))
        else:
            row = cells_of_row(line)
            if row[0] == '---':
                continue
            for name, text in zip(names[1:], row[1:]):
                number = NUMBER.match(text)
                found.append(Cell(name, row[0], group, number.group() if number else '', section))
    return found


def matches(name: str, patterns: str) -> bool:
    """Whether a name fits one of the patterns and none of the exceptions."""
    parts = [part.strip() for part in patterns.split(';')]
    wanted = [part for part in parts if not part.startswith('!')]
    return any(fnmatchcase(name, part) for part in wanted) \
        and not any(fnmatchcase(name, part[1:]) for part in parts if part.startswith('!'))


class Tables:
    """Looks up what the tables of a report say."""

    def __init__(self, cells: List[Cell]):
        self._cells = cells
        self._first: Dict[Tuple[str, str], str] = {}
        for cell in cells:
            self._first.setdefault((cell.column, cell.group), cell.section)

    def find(self, column: str, methods: str, groups: str) -> List[Cell]:
        """The cells that have a number, in the order of the tables. An exact name is no pattern."""
        section = next((cell.section for cell in self._cells if column.startswith(f'{cell.section}: ')), '')
        name = column[len(section) + 2:] if section else column
        return [cell for cell in self._cells if cell.text
                and cell.column == name
                and cell.section == (section or self._first[cell.column, cell.group])
                and (cell.method == methods or matches(cell.method, methods))
                and (cell.group == groups or matches(cell.group, groups))]

    def paired(self, column: str, first: str, second: str, groups: str) -> List[Tuple[float, float]]:
        """Each of the first methods with each of the second ones of the same group; empty if one has none."""
        pairs: List[Tuple[float, float]] = []
        for cell in self.find(column, first, groups):
            theirs = self.find(column, second, cell.group)
            if not theirs:
                return []
            pairs += [(cell.value, other.value) for other in theirs if other != cell]
        return pairs

    def across(self, column: str, methods: str, first: str, second: str) -> List[Tuple[float, float]]:
        """Each method in the first groups with itself in each of the second ones; empty if there is none."""
        return [(cell.value, other.value) for cell in self.find(column, methods, first)
                for other in self.find(column, cell.method, second)]

    def values(self, column: str, methods: str, groups: str) -> List[float]:
        """Of methods, or of a ratio or difference of methods or groups. Throws ZeroDivisionError."""
        of_methods, of_groups = (split_by(text, list(OPERATIONS)) for text in (methods, groups))
        if of_methods:
            first, name, second = of_methods
            return [OPERATIONS[name](*pair) for pair in self.paired(column, first, second, groups)]
        if of_groups:
            first, name, second = of_groups
            return [OPERATIONS[name](*pair) for pair in self.across(column, methods, first, second)]
        return [cell.value for cell in self.find(column, methods, groups)]


def split_by(text: str, operators: List[str]) -> Optional[Tuple[str, str, str]]:
    """Left side, operator with spaces around it, right side."""
    for name in operators:
        left, middle, right = text.partition(f' {name} ')
        if middle:
            return left.strip(), name, right.strip()
    return None


def span(values: List[float], shown: Callable[[float], str]) -> str:
    """One number, or the smallest and the largest."""
    if not values:
        return NO_DATA
    low, high = (re.sub(r'^[-+]0(\.0*)?$', r'0\1', shown(value)) for value in (min(values), max(values)))
    return low if low == high else f'{low} to {high}'


def computed(part: str, tables: Tables) -> str:
    """What a part in braces says."""
    part = ' '.join(part.split())
    question, asked, answers = part.partition(' ? ')
    fields = [field.strip() for field in question.split('|')]
    if not 2 <= len(fields) <= 4 or not all(fields) or (asked and len(fields) > 3):
        raise DiscussionError(f'{{{part}}}: must be {{COLUMN | METHODS | GROUPS}}')
    column, methods = fields[:2]
    groups = fields[2] if len(fields) > 2 else '*'
    try:
        if asked:
            return chosen(part, answers, compared(part, column, methods, groups, tables))
        return numbers(column, methods, groups, fields[3] if len(fields) > 3 else '', tables)
    except ZeroDivisionError:
        return NO_DATA
    except ValueError as error:
        raise DiscussionError(f'{{{part}}}: {error}') from error


def numbers(column: str, methods: str, groups: str, form: str, tables: Tables) -> str:
    """Values as the tables show them, or in a format."""
    operation = split_by(methods, list(OPERATIONS)) or split_by(groups, list(OPERATIONS))
    form = form or (DEFAULT_FORMATS[operation[1]] if operation else '')
    if form:
        return span(tables.values(column, methods, groups), lambda value: format(value, form))
    texts = {cell.value: cell.text for cell in tables.find(column, methods, groups)}
    return span(list(texts), lambda value: texts[value])


def compared(part: str, column: str, methods: str, groups: str, tables: Tables) -> Optional[bool]:
    """Whether a comparison holds everywhere; None without data."""
    of_groups = split_by(groups, list(COMPARISONS))
    found = split_by(methods, list(COMPARISONS)) or of_groups
    if not found:
        raise DiscussionError(f'{{{part}}}: compares nothing, allowed: {" ".join(COMPARISONS)}')
    first, name, second = found
    if of_groups:
        pairs = tables.across(column, methods, first, second)
    elif NUMBER.fullmatch(second):
        pairs = [(value, float(second)) for value in tables.values(column, first, groups)]
    else:
        pairs = tables.paired(column, first, second, groups)
    return all(COMPARISONS[name](*pair) for pair in pairs) if pairs else None


def chosen(part: str, answers: str, holds: Optional[bool]) -> str:
    """The words of a comparison."""
    yes, colon, no = answers.partition(' : ')
    if not colon:
        raise DiscussionError(f'{{{part}}}: needs words for both cases, with a colon between them')
    return NO_DATA if holds is None else (yes if holds else no).strip()


def filled(paragraph: str) -> str:
    """A paragraph, or the items of a list, in lines of the usual width."""
    items: List[List[str]] = []
    for line in paragraph.splitlines():
        if not items or ITEM.match(line):
            items.append([])
        items[-1].append(line)
    lines = []
    for item in items:
        mark = ITEM.match(item[0])
        lines.append(textwrap.fill(' '.join(' '.join(item).split()), WIDTH, break_long_words=False,
                                   break_on_hyphens=False, subsequent_indent=' ' * len(mark.group()) if mark else ''))
    return '\n'.join(lines)


def discussed(discussion: str, report: str, warn: Callable[[str], None]) -> str:
    """The discussion with all its parts computed from the tables of the report.

    A part that cannot be understood stays as it is. `warn`: gets a line for each such part, and for each without data.
    """
    tables = Tables(cells_of(report))

    def replaced(part: 're.Match[str]') -> str:
        if '|' not in part.group(1):
            return part.group()
        try:
            said = computed(part.group(1), tables)
        except DiscussionError as error:
            warn(f'discussion: {error}')
            return part.group()
        if said == NO_DATA:
            warn(f'discussion: {{{" ".join(part.group(1).split())}}}: the tables have no such numbers')
        return said

    paragraphs = []
    for paragraph in re.split(r'\n\s*\n', discussion.strip('\n')):
        said = PART.sub(replaced, paragraph)
        paragraphs.append(said if said == paragraph else filled(said))
    return '\n\n'.join(paragraphs).rstrip() + '\n'
