"""Assembles the report."""
import re
import sys
from pathlib import Path
from typing import List, Optional, Tuple

from .data import DataError, Results, read_description, read_results
from .discussion import discussed
from .figures import Figures
from .files import written_whole
from .papers import Papers
from .tables import (claims_tables, escape, filtered_tables, pose_tables, relative_tables, reliability_table,
                     result_tables, tracking_tables, trust_tables)
from .words import in_words


DISCUSSION = '\n## Discussion\n\n'
BEHIND = re.compile('\n## (?:Figures|Tracking and cost)\n')


def counted(count: int, what: str) -> str:
    """A number with its noun, singular or plural."""
    return f'{count} {what}' if count == 1 else f'{count} {what}s'


def introduction(results: Results) -> str:
    """Title, source, and what was run."""
    title = escape(results.description.get('title') or results.experiment)
    text = f'# {title}\n\n'
    source = results.description.get('source')
    if source:
        text += f'Source: {escape(source)}.\n\n'
    recordings = {name for pair in results.pairs for name in pair}
    facts = [counted(len(results.methods()), 'method')]
    if results.pairs:
        facts.insert(0, counted(len(recordings), 'recording'))
        facts.append(counted(len(results.pairs), 'pair') + ' (map → drive): '
                     + ', '.join(f'{escape(train)} → {escape(test)}' for train, test in results.pairs))
    runs = [outcome.get('runs') for outcome in results.outcomes]
    known = [value for value in runs if value is not None]
    if known:
        facts.append(counted(int(sum(known)), 'run'))
    return text + f'Experiment `{escape(results.experiment)}`: ' + '; '.join(facts) + '.\n\n'


def report_text(results: Results, papers: Papers, figures: List[Tuple[str, str]]) -> str:
    """The whole report in Markdown."""
    text = introduction(results) + '## Results\n\n' + result_tables(results, papers)
    for title, tables in (('Right places and wrong claims', claims_tables(results)),
                          ('Not wrong, % (images), by the probability around the estimate', reliability_table(results)),
                          ('Poses: recall within position and heading', pose_tables(results)),
                          ('Poses in relation to the map', relative_tables(results)),
                          ('Poses behind a filter', filtered_tables(results))):
        text += f'\n## {title}\n\n{tables}' if tables else ''
    text += '\n## Comparison with the papers\n\n' + in_words(results, papers)
    if results.description.get('discussion'):
        text += f'{DISCUSSION}\n'
    if figures:
        text += '\n## Figures\n\n' + '\n\n'.join(f'![{escape(caption)}](figures/{name})' for name, caption in figures)
        text += '\n'
    text += '\n## Tracking and cost\n\n' + tracking_tables(results)
    trust = trust_tables(results)
    text += f'\n## Reliability of the states\n\n{trust}' if trust else ''
    return with_discussion(text, str(results.description.get('discussion', '')))


def with_discussion(report: str, discussion: str) -> str:
    """The report with this discussion, computed from its tables, in place of the one it has."""
    before, heading, after = report.partition(DISCUSSION)
    if not heading:
        return report
    behind = BEHIND.search(after)
    rest = after[behind.start():] if behind else ''

    def warn(text: str) -> None:
        print(f'report_evaluation: {text}', file=sys.stderr)

    return before + heading + discussed(discussion, before + rest, warn) + rest


def write_report(folder: Path, papers_path: Optional[Path], file_format: str) -> int:
    """Writes figures and report into the folder; returns the number of figures."""
    papers = Papers(papers_path)
    results = read_results(folder)
    figures = Figures(results, papers).write(folder / 'figures', file_format)
    text = report_text(results, papers, figures)
    with written_whole(folder / 'report.md') as partial:
        partial.write_text(text, encoding='utf-8')
    return len(figures)


def renew_discussion(folder: Path, experiment: Path) -> None:
    """Computes the discussion of a report again, from its own tables and the text of an experiment's YAML file."""
    report = folder / 'report.md'
    try:
        text = report.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(report, getattr(error, 'strerror', None) or 'is not a text in UTF-8') from error
    if DISCUSSION not in text:
        raise DataError(report, 'has no discussion')
    if not experiment.is_file():
        raise DataError(experiment, 'is not a file')
    discussion = read_description(experiment).get('discussion')
    if not discussion:
        raise DataError(experiment, 'has no discussion')
    with written_whole(report) as partial:
        partial.write_text(with_discussion(text, str(discussion)), encoding='utf-8')
