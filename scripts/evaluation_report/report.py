"""Assembles the report."""
import re
from pathlib import Path
from typing import List, Optional, Tuple

from .data import DataError, Results, read_results
from .figures import Figures
from .files import written_whole
from .papers import Papers
from .tables import (claims_tables, escape, filtered_tables, pose_tables, relative_tables, reliability_table,
                      result_tables, swarm_speed_table, tracking_tables, trust_tables)

# What somebody wrote into a report by hand stays when it is written again.
DISCUSSION = re.compile(r'^## Discussion\n.*?(?=^## |\Z)', re.DOTALL | re.MULTILINE)


def counted(count: int, what: str) -> str:
    return f'{count} {what}' if count == 1 else f'{count} {what}s'


def introduction(results: Results) -> str:
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


def report_text(results: Results, papers: Papers, figures: List[Tuple[str, str]], discussion: str) -> str:
    text = introduction(results) + '## Results\n\n' + result_tables(results, papers)
    for title, tables in (('Right places and wrong claims', claims_tables(results)),
                          ('Not wrong, % (images), by the probability around the estimate', reliability_table(results)),
                          ('Poses: recall within position and heading', pose_tables(results)),
                          ('Poses in relation to the map', relative_tables(results)),
                          ('Poses behind a filter', filtered_tables(results)),
                          ('Speed of the swarm and of the robot', swarm_speed_table(results))):
        text += f'\n## {title}\n\n{tables}' if tables else ''
    text += f'\n{discussion.rstrip()}\n' if discussion else ''
    if figures:
        text += '\n## Figures\n\n' + '\n\n'.join(f'![{escape(caption)}](figures/{name})' for name, caption in figures)
        text += '\n'
    text += '\n## Tracking and cost\n\n' + tracking_tables(results)
    trust = trust_tables(results)
    return text + (f'\n## Reliability of the states\n\n{trust}' if trust else '')


def discussion_of(report: Path) -> str:
    """The discussion in a report that is there, with its heading; nothing where there is none."""
    try:
        found = DISCUSSION.search(report.read_text(encoding='utf-8'))
    except FileNotFoundError:
        return ''
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(report, getattr(error, 'strerror', None) or 'is not a text in UTF-8') from error
    return found.group() if found else ''


def write_report(folder: Path, papers_path: Optional[Path], file_format: str) -> int:
    """Writes figures and report into the folder; returns the number of figures."""
    papers = Papers(papers_path)
    results = read_results(folder)
    figures = Figures(results, papers).write(folder / 'figures', file_format)
    text = report_text(results, papers, figures, discussion_of(folder / 'report.md'))
    with written_whole(folder / 'report.md') as partial:
        partial.write_text(text, encoding='utf-8')
    return len(figures)
