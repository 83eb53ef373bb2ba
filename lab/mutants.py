#!/usr/bin/python3
"""Puts mutants into C++ files. See mutate.sh.

All mutants are in one program: each place that can be mutated asks whether its mutant is the active one (environment
variable MUTANT), so that one build serves them all. Places are found by libclang.
"""
import argparse
import json
import re
import shlex
import shutil
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

from clang.cindex import CursorKind, Index, TypeKind

MOST = 1 << 16  # mutants, as in mutation.h
COMPARISONS = {'<': ('less', '<=', '>='), '<=': ('lessEqual', '<', '>'), '>': ('greater', '>=', '<='),
               '>=': ('greaterEqual', '>', '<')}
EQUALITIES = {'==': ('equal', '!='), '!=': ('unequal', '==')}
ARITHMETIC = {'+': ('plus', '-'), '-': ('minus', '+'), '*': ('times', '/'), '/': ('over', '*')}
ASSIGNMENTS = {'+=': ('add', '-='), '-=': ('subtract', '+='), '*=': ('scale', '/=')}
FUNCTORS = {'max': ('Max', 1), 'min': ('Min', 1), 'clamp': ('Clamp', 2), 'abs': ('Abs', 1)}
FUNCTIONS = {CursorKind.FUNCTION_DECL, CursorKind.CXX_METHOD, CursorKind.CONSTRUCTOR, CursorKind.FUNCTION_TEMPLATE,
             CursorKind.LAMBDA_EXPR}
CONDITIONS = {CursorKind.IF_STMT, CursorKind.WHILE_STMT, CursorKind.CONDITIONAL_OPERATOR}
INTEGERS = {TypeKind.INT, TypeKind.UINT, TypeKind.LONG, TypeKind.ULONG, TypeKind.LONGLONG, TypeKind.ULONGLONG,
            TypeKind.SHORT, TypeKind.USHORT, TypeKind.UCHAR, TypeKind.SCHAR}
FLOATS = {TypeKind.DOUBLE, TypeKind.FLOAT}
TRANSPARENT = {CursorKind.UNEXPOSED_EXPR, CursorKind.PAREN_EXPR}


def inner(cursor):
    """The expression below casts and parentheses that are not written as a call."""
    while cursor.kind in TRANSPARENT:
        children = list(cursor.get_children())
        if len(children) != 1:
            break
        cursor = children[0]
    return cursor


def is_number(kind) -> bool:
    return kind in INTEGERS or kind in FLOATS


class Mutator:
    """The mutants of one file: `edits` insert text at offsets of its bytes, `mutants` say what each does."""

    def __init__(self, path: Path, arguments: list, first_id: int, left_out: set):
        self.path, self.source, self.left_out = path, path.read_bytes(), left_out
        self.inserted, self.replaced, self.mutants, self.next = defaultdict(list), {}, [], first_id
        unit = Index.create().parse(str(path), args=arguments)
        errors = [d for d in unit.diagnostics if d.severity >= 3]
        if errors:
            sys.exit(f'{path}: libclang cannot read it: {errors[0].spelling}')
        for cursor in unit.cursor.get_children():
            if cursor.location.file and Path(cursor.location.file.name) == path:
                self.walk(cursor, False, [])

    # -- places

    def walk(self, cursor, in_function: bool, parents: list):
        if cursor.kind in FUNCTIONS:
            if cursor.spelling == 'declare':
                return  # parameters: the generated tables and YAML files are compared with them
            in_function = True
        if cursor.kind == CursorKind.VAR_DECL and self.is_constant(cursor):
            self.visit_constant(cursor)
            return
        if cursor.kind in (CursorKind.STATIC_ASSERT, CursorKind.TYPE_REF, CursorKind.CASE_STMT, CursorKind.TYPEDEF_DECL,
                           CursorKind.TYPE_ALIAS_DECL, CursorKind.ENUM_DECL, CursorKind.FIELD_DECL):
            return
        if in_function:
            self.visit(cursor, parents)
        for child in cursor.get_children():
            self.walk(child, in_function, parents + [cursor])

    def is_constant(self, cursor) -> bool:
        return b'constexpr' in self.source[cursor.extent.start.offset:cursor.extent.end.offset].split(b'=')[0]

    def visit_constant(self, cursor):
        """`constexpr double kName = 0.5;` of a file becomes a constant that is set when the program starts."""
        text = self.text(cursor)
        match = re.match(r'constexpr (?:double|float|int|std::size_t|std::int64_t) \w+ = ([\d.eE\'-]+)$', text)
        if not match:
            return
        ids = self.add(cursor, [f'{text}: {"twice" if "." in match.group(1) else "one more"}'])
        if ids is None:
            return
        start = cursor.extent.start.offset
        self.replaced[start] = (start + len('constexpr'), 'const')
        kind = text.split()[1]
        self.wrap(start + match.start(1), start + match.end(1), f'::mutation::constant({ids}, {kind}(', '))')

    def visit(self, cursor, parents: list):
        kind = cursor.kind
        if kind == CursorKind.BINARY_OPERATOR:
            self.visit_binary(cursor)
        elif kind == CursorKind.COMPOUND_ASSIGNMENT_OPERATOR:
            self.visit_assignment(cursor)
        elif kind == CursorKind.CALL_EXPR:
            self.visit_call(cursor, parents)
        elif kind == CursorKind.UNARY_OPERATOR:
            self.visit_unary(cursor)
        elif kind in (CursorKind.INTEGER_LITERAL, CursorKind.FLOATING_LITERAL, CursorKind.CXX_BOOL_LITERAL_EXPR):
            self.visit_literal(cursor, parents)
        if kind in CONDITIONS:
            self.visit_condition(list(cursor.get_children())[0])
        if kind == CursorKind.RETURN_STMT:
            for child in cursor.get_children():
                if child.type.get_canonical().kind == TypeKind.BOOL:
                    self.visit_condition(child)
        if kind == CursorKind.COMPOUND_STMT or kind in (CursorKind.IF_STMT, CursorKind.FOR_STMT,
                                                        CursorKind.CXX_FOR_RANGE_STMT):
            children = list(cursor.get_children())
            branches = {CursorKind.COMPOUND_STMT: children, CursorKind.IF_STMT: children[1:]}
            for child in branches.get(kind, children[-1:]):
                self.visit_statement(child)

    def visit_binary(self, cursor):
        left, right, op, at = self.operands(cursor)
        if op in COMPARISONS:
            name, boundary, opposite = COMPARISONS[op]
            self.call(cursor, left, right, at, op, name, [f'{op} becomes {boundary}', f'{op} becomes {opposite}'])
        elif op in EQUALITIES:
            name, other = EQUALITIES[op]
            self.call(cursor, left, right, at, op, name, [f'{op} becomes {other}'])
        elif op in ARITHMETIC and is_number(cursor.type.get_canonical().kind):
            name, other = ARITHMETIC[op]
            self.call(cursor, left, right, at, op, name, [f'{op} becomes {other}'])
        elif op in ('&&', '||'):
            for side, operand in (('left', left), ('right', right)):
                neutral = 'true' if op == '&&' else 'false'
                ids = self.add(operand, [f'{side} of {op} is always {neutral}: {self.text(operand)}'])
                if ids is not None:
                    self.wrap(operand.extent.start.offset, operand.extent.end.offset,
                              f'::mutation::forced({ids}, {neutral}, static_cast<bool>(', '))')

    def visit_assignment(self, cursor):
        left, right, op, at = self.operands(cursor)
        if op in ASSIGNMENTS and is_number(cursor.type.get_canonical().kind):
            name, other = ASSIGNMENTS[op]
            self.call(cursor, left, right, at, op, name, [f'{op} becomes {other}'])

    def visit_call(self, cursor, parents: list):
        name = cursor.spelling
        if name.startswith('operator'):
            self.visit_operator(cursor, name[len('operator'):])
        elif name in FUNCTORS:
            written = f'std::{name}'.encode()
            start = cursor.extent.start.offset
            following = self.source[start + len(written):start + len(written) + 1]
            if self.source.startswith(written, start) and following == b'(':
                functor, count = FUNCTORS[name]
                others = {'max': ['std::max becomes std::min'], 'min': ['std::min becomes std::max'],
                          'clamp': ['no lower limit', 'no upper limit'], 'abs': ['std::abs is left out']}[name]
                ids = self.add(cursor, [f'{text}: {self.text(cursor)}' for text in others])
                if ids is not None:
                    self.replaced[start] = (start + len(written), f'::mutation::{functor}{{{ids}}}')

    def visit_operator(self, cursor, op: str):
        """An operator that is a function: of Eigen's matrices, or a comparison."""
        children = list(cursor.get_children())
        of_eigen = 'Eigen' in cursor.type.get_canonical().spelling
        if op in EQUALITIES:
            function, other = EQUALITIES[op]
        elif op in ('+', '-') and of_eigen:
            function, other = ARITHMETIC[op]
        elif op in ('+=', '-=') and of_eigen:
            function, other = ASSIGNMENTS[op]
        else:
            return
        if len(children) != 3:
            return
        left, right = children[0], children[2]
        at = self.find(op.encode(), left.extent.end.offset, right.extent.start.offset)
        if at is not None:
            self.call(cursor, left, right, at, op, function, [f'{op} becomes {other}'])

    def visit_unary(self, cursor):
        start = cursor.extent.start.offset
        token = self.source[start:start + 1]
        child = next(iter(cursor.get_children()), None)
        if child is None:
            return
        if token == b'!':
            ids = self.add(cursor, [f'without !: {self.text(cursor)}'])
            if ids is not None:
                self.wrap(start, cursor.extent.end.offset, f'::mutation::truth({ids}, ', ')')
        elif self.is_minus(start, child) and is_number(cursor.type.get_canonical().kind):
            ids = self.add(cursor, [f'without -: {self.text(cursor)}'])
            if ids is not None:
                self.replaced[start] = (start + 1, '')
                self.wrap(start, cursor.extent.end.offset, f'::mutation::negative({ids}, ', ')')

    def is_minus(self, start: int, operand) -> bool:
        return re.match(b'-[^-]', self.source[start:start + 2]) is not None and operand.extent.start.offset > start

    def visit_literal(self, cursor, parents: list):
        text = self.text(cursor)
        if not text or not (text[0].isdigit() or text in ('true', 'false')):
            return
        if any(p.kind == CursorKind.ARRAY_SUBSCRIPT_EXPR for p in parents[-2:]):
            return
        if any(p.kind == CursorKind.CALL_EXPR and p.spelling == 'reserve' for p in parents):
            return  # only how fast
        if any(p.kind == CursorKind.VAR_DECL and p.type.kind == TypeKind.CONSTANTARRAY for p in parents[-3:]):
            return
        what = 'the opposite' if text in ('true', 'false') else 'one more'
        if cursor.kind == CursorKind.FLOATING_LITERAL:
            what = 'one' if float(text.rstrip('fF').replace("'", '')) == 0.0 else 'twice'
        ids = self.add(cursor, [f'{text} becomes {what} in {self.line(cursor)}'])
        if ids is not None:
            self.wrap(cursor.extent.start.offset, cursor.extent.end.offset, f'::mutation::constant({ids}, ', ')')

    def visit_condition(self, condition):
        expression = inner(condition)
        if expression.kind in (CursorKind.BINARY_OPERATOR, CursorKind.UNARY_OPERATOR, CursorKind.VAR_DECL,
                               CursorKind.DECL_STMT, CursorKind.CXX_BOOL_LITERAL_EXPR):
            return  # has mutants of its own
        if expression.kind == CursorKind.CALL_EXPR and expression.spelling in ('operator==', 'operator!='):
            return
        if not condition.kind.is_expression():
            return
        ids = self.add(condition, [f'not {self.text(condition)}'])
        if ids is not None:
            self.wrap(condition.extent.start.offset, condition.extent.end.offset,
                      f'::mutation::truth({ids}, static_cast<bool>(', '))')

    def visit_statement(self, statement):
        """A call or an assignment that is a statement can be left out."""
        expression = inner(statement)
        if expression.kind not in (CursorKind.CALL_EXPR, CursorKind.BINARY_OPERATOR,
                                   CursorKind.COMPOUND_ASSIGNMENT_OPERATOR):
            return
        start, end = statement.extent.start.offset, statement.extent.end.offset
        if self.source[end:end + 1] != b';' or b'.reserve(' in self.source[start:end]:
            return
        ids = self.add(statement, [f'left out: {self.text(statement)}'])
        if ids is not None:
            self.wrap(start, end, f'(::mutation::on({ids}) ? void() : void(', '))')

    # -- text

    def text(self, cursor) -> str:
        start, end = cursor.extent.start.offset, cursor.extent.end.offset
        return ' '.join(self.source[start:end].decode(errors='replace').split())

    def line(self, cursor) -> str:
        return self.source.split(b'\n')[cursor.location.line - 1].decode(errors='replace').strip()

    def operands(self, cursor):
        left, right = list(cursor.get_children())
        between = self.source[left.extent.end.offset:right.extent.start.offset]
        match = re.search(rb'[-+*/%<>=!&|^]+', between)
        if not match:
            return left, right, None, None
        return left, right, match.group().decode(), left.extent.end.offset + match.start()

    def find(self, token: bytes, start: int, end: int):
        at = self.source.find(token, start, end)
        return at if at >= 0 and self.source[start:at].strip(b' )\n') == b'' else None

    def add(self, cursor, descriptions: list):
        """The first id of the mutants of a place, or nothing where none may be."""
        start = cursor.extent.start
        line = start.line
        if line in self.left_out or start.offset < 0 or not start.file or Path(start.file.name) != self.path:
            return None
        first = self.next
        for description in descriptions:
            self.mutants.append({'id': self.next, 'file': str(self.path), 'line': line, 'what': description})
            self.next += 1
        return first

    def call(self, cursor, left, right, at, op, function, descriptions: list):
        ids = self.add(cursor, [f'{text}: {self.text(cursor)}' for text in descriptions])
        if ids is None:
            return
        self.wrap(cursor.extent.start.offset, cursor.extent.end.offset, f'::mutation::{function}({ids}, ', ')')
        self.replaced[at] = (at + len(op), ',')

    def wrap(self, start: int, end: int, before: str, after: str):
        size = end - start
        self.inserted[start].append((0, -size, before))  # the wider one first
        self.inserted[end].append((-1, size, after))     # what ends here before what begins; the narrower one first

    def mutated(self) -> bytes:
        """The file with all its mutants, line by line where it was."""
        out, at = [], 0
        for offset in sorted(set(self.inserted) | set(self.replaced)):
            if offset < at:
                continue
            out.append(self.source[at:offset])
            for _, _, text in sorted(self.inserted.get(offset, []), key=lambda entry: entry[:2]):
                out.append(text.encode())
            at = offset
            if offset in self.replaced:
                at, text = self.replaced[offset]
                out.append(text.encode())
        out.append(self.source[at:])
        return b'#include "mutation.h"\n#line 1\n' + b''.join(out)


def arguments_of(database: list, path: Path) -> list:
    """How the file is compiled, for libclang."""
    entry = next(e for e in database if Path(e['file']) == path)
    words = shlex.split(entry['command'])[1:]
    kept, skip = [], False
    for word in words:
        if skip:
            skip = False
        elif word in ('-o', '-c', '-include') or word == str(path):
            skip = word in ('-o', '-include')
        elif word.startswith(('-I', '-D', '-std', '-isystem')) or not word.startswith('-'):
            kept.append(word)
    clang = subprocess.run(['clang', '-print-resource-dir'], capture_output=True, text=True, check=True)
    return kept + ['-isystem', clang.stdout.strip() + '/include']


def insert(options) -> int:
    """Mutates the files; those lines that do not compile with mutants are left as they are."""
    source, build = Path(options.source).resolve(), Path(options.build).resolve()
    database = json.loads((build / 'compile_commands.json').read_text())
    shutil.copy(Path(__file__).with_name('mutation.h'), source / 'src')
    originals = {}
    for folder in options.folder:
        for path in sorted((source / 'src' / folder).glob('*.cpp')):
            originals[path] = path.read_bytes()
    mutants = []
    for path, original in originals.items():
        left_out = set()
        arguments = arguments_of(database, path)
        for _ in range(40):
            path.write_bytes(original)
            mutator = Mutator(path, arguments, len(mutants), left_out)
            path.write_bytes(mutator.mutated())
            entry = next(e for e in database if Path(e['file']) == path)
            words = [word for word in shlex.split(entry['command']) if word != '-Werror']
            output = words.index('-o')
            words[output:output + 2] = ['-fsyntax-only', '-w']
            result = subprocess.run(words, cwd=entry['directory'], capture_output=True, text=True, check=False)
            if result.returncode == 0:
                break
            lines = {int(n) for n in re.findall(rf'{re.escape(path.name)}:(\d+):', result.stderr)} - left_out
            if not lines:
                sys.exit(f'{path}: does not compile:\n{result.stderr[:2000]}')
            left_out |= lines
        mutants += mutator.mutants
        print(f'{path.relative_to(source)}: {len(mutator.mutants)} mutants'
              + (f', {len(left_out)} lines left as they are' if left_out else ''), flush=True)
    if len(mutants) > MOST:
        sys.exit(f'{len(mutants)} mutants, of which mutation.h can tell {MOST} apart')
    alike = Counter()
    for mutant in mutants:
        mutant['file'] = str(Path(mutant['file']).relative_to(source))
        text = mutant['file'], mutant['what']
        mutant['nth'] = alike[text]  # of those that read alike: no edit elsewhere changes who it is
        alike[text] += 1
    Path(options.out).write_text(json.dumps(mutants, indent=0))
    print(f'{len(mutants)} mutants')
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--source', required=True)
    parser.add_argument('--build', required=True, help='a configured build of it')
    parser.add_argument('--out', required=True, help='what each mutant is, JSON')
    parser.add_argument('folder', nargs='+', help='folders of src')
    return insert(parser.parse_args())


if __name__ == '__main__':
    sys.exit(main())
