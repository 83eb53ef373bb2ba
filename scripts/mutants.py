#!/usr/bin/python3
"""Puts mutants into C++ files, runs the tests on each, and reports which no test notices. See mutate.sh.

All mutants are in one program: each place that can be mutated asks whether its mutant is the active one (environment
variable MUTANT), so that one build serves them all. Places are found by libclang.
"""
import argparse
import concurrent.futures
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

from clang.cindex import CursorKind, Index, TypeKind

RUNTIME = r'''#pragma once
// Written by scripts/mutants.py: what a place with mutants asks.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <type_traits>
#include <utility>

#include <Eigen/Core>

namespace mutation {

inline constexpr int kMost = 1 << 16;

struct State {
  int active = -1;
  const char* log = nullptr;
  bool reached[kMost] = {};

  State() : log(std::getenv("MUTANTS_REACHED")) {
    if (const char* text = std::getenv("MUTANT")) active = std::atoi(text);
  }
  ~State() {
    if (log == nullptr) return;
    std::FILE* file = std::fopen(log, "a");
    if (file == nullptr) return;
    for (int id = 0; id < kMost; ++id) {
      if (reached[id]) std::fprintf(file, "%d\n", id);
    }
    std::fclose(file);
  }
};
inline State state;

inline bool on(int id) {
  if (state.log != nullptr) state.reached[id] = true;
  return id == state.active;
}

inline bool truth(int id, bool value) { return on(id) ? !value : value; }
inline bool forced(int id, bool to, bool value) { return on(id) ? to : value; }

template <class T>
T constant(int id, T value) {
  if (!on(id)) return value;
  if constexpr (std::is_floating_point_v<T>) return value == T(0) ? T(1) : value * T(2);
  else return static_cast<T>(value + 1);
}
inline bool constant(int id, bool value) { return on(id) ? !value : value; }

#define MUTATION_COMPARISON(name, op, boundary, opposite)                       \
  template <class A, class B>                                                   \
  bool name(int id, const A& a, const B& b) {                                   \
    if (on(id)) return a boundary b;                                            \
    if (on(id + 1)) return a opposite b;                                        \
    return a op b;                                                              \
  }
MUTATION_COMPARISON(less, <, <=, >=)
MUTATION_COMPARISON(lessEqual, <=, <, >)
MUTATION_COMPARISON(greater, >, >=, <=)
MUTATION_COMPARISON(greaterEqual, >=, >, <)
#undef MUTATION_COMPARISON
template <class A, class B>
bool equal(int id, const A& a, const B& b) { return on(id) ? !(a == b) : a == b; }
template <class A, class B>
bool unequal(int id, const A& a, const B& b) { return on(id) ? a == b : a != b; }

#define MUTATION_ARITHMETIC(name, op, other)                                                                \
  template <class A, class B, std::enable_if_t<std::is_arithmetic_v<A> && std::is_arithmetic_v<B>, int> = 0> \
  auto name(int id, A a, B b) { return on(id) ? a other b : a op b; }
MUTATION_ARITHMETIC(plus, +, -)
MUTATION_ARITHMETIC(minus, -, +)
MUTATION_ARITHMETIC(times, *, /)
MUTATION_ARITHMETIC(over, /, *)
#undef MUTATION_ARITHMETIC
template <class A, class B>
typename A::PlainObject plus(int id, const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return on(id) ? (a - b).eval() : (a + b).eval();
}
template <class A, class B>
typename A::PlainObject minus(int id, const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return on(id) ? (a + b).eval() : (a - b).eval();
}
template <class A, class B>
void add(int id, A&& a, const B& b) { if (on(id)) a -= b; else a += b; }
template <class A, class B>
void subtract(int id, A&& a, const B& b) { if (on(id)) a += b; else a -= b; }
template <class A, class B>
void scale(int id, A&& a, const B& b) { if (on(id)) a /= b; else a *= b; }

template <class T>
T negative(int id, T value) { return on(id) ? value : -value; }

struct Max {
  int id;
  template <class T> T operator()(const T& a, const T& b) const { return on(id) ? std::min(a, b) : std::max(a, b); }
};
struct Min {
  int id;
  template <class T> T operator()(const T& a, const T& b) const { return on(id) ? std::max(a, b) : std::min(a, b); }
};
struct Clamp {
  int id;
  template <class T> T operator()(const T& value, const T& low, const T& high) const {
    if (on(id)) return std::min(value, high);
    if (on(id + 1)) return std::max(value, low);
    return std::clamp(value, low, high);
  }
};
struct Abs {
  int id;
  template <class T> T operator()(T value) const { return on(id) ? value : std::abs(value); }
};

}  // namespace mutation
'''

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
        elif token == b'-' and self.source[start + 1:start + 2] != b'-' and is_number(cursor.type.get_canonical().kind) and child.extent.start.offset > start:
            ids = self.add(cursor, [f'without -: {self.text(cursor)}'])
            if ids is not None:
                self.replaced[start] = (start + 1, '')
                self.wrap(start, cursor.extent.end.offset, f'::mutation::negative({ids}, ', ')')

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
        line = cursor.extent.start.line
        if line in self.left_out or cursor.extent.start.offset < 0:
            return None
        if Path(cursor.extent.start.file.name) != self.path if cursor.extent.start.file else True:
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
        return b'#include "mutation.h" /**/ ' + b''.join(out) if not b''.join(out).startswith(b'#') else \
            b''.join(out).replace(b'\n', b'\n#include "mutation.h"\n#line 2\n', 1)


def arguments_of(database: list, path: Path) -> list:
    """How the file is compiled, for libclang."""
    entry = next(e for e in database if Path(e['file']) == path)
    words = entry['command'].split()[1:]
    kept, skip = [], False
    for word in words:
        if skip:
            skip = False
        elif word in ('-o', '-c', '-include') or word == str(path):
            skip = word in ('-o', '-include')
        elif word.startswith(('-I', '-D', '-std', '-isystem')) or not word.startswith('-'):
            kept.append(word)
    include = subprocess.run(['clang', '-print-resource-dir'], capture_output=True, text=True, check=True).stdout.strip()
    return kept + ['-isystem', include + '/include']


def insert(options) -> int:
    """Mutates the files; those lines that do not compile with mutants are left as they are."""
    source, build = Path(options.source).resolve(), Path(options.build).resolve()
    database = json.loads((build / 'compile_commands.json').read_text())
    (source / 'src' / 'mutation.h').write_text(RUNTIME)
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
            command = re.sub(r' -o \S+', ' -fsyntax-only -w', entry['command']).replace('-Werror', '')
            result = subprocess.run(command, shell=True, cwd=entry['directory'], capture_output=True, text=True)
            if result.returncode == 0:
                break
            lines = {int(n) for n in re.findall(rf'{re.escape(path.name)}:(\d+):', result.stderr)} - left_out
            if not lines:
                sys.exit(f'{path}: does not compile:\n{result.stderr[:2000]}')
            left_out |= lines
        mutants += mutator.mutants
        print(f'{path.relative_to(source)}: {len(mutator.mutants)} mutants'
              + (f', {len(left_out)} lines left as they are' if left_out else ''), flush=True)
    for mutant in mutants:
        mutant['file'] = str(Path(mutant['file']).relative_to(source))
    Path(options.out).write_text(json.dumps(mutants, indent=0))
    print(f'{len(mutants)} mutants')
    return 0


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
    os.nice(5)


def run_tests(program: str, tests: list, environment: dict, timeout_s: float) -> str:
    """'passed', 'failed' or 'timed out'."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            result = subprocess.run(
                [program, '--gtest_filter=' + ':'.join(tests), '--gtest_fail_fast', '--gtest_brief=1'],
                env={**os.environ, 'TMPDIR': folder, **environment}, stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, timeout=timeout_s, preexec_fn=limits, check=False)
        except subprocess.TimeoutExpired:
            return 'timed out'
    return 'passed' if result.returncode == 0 else 'failed'


def list_tests(program: str) -> list:
    names, suite = [], ''
    text = subprocess.run([program, '--gtest_list_tests'], capture_output=True, text=True, check=True).stdout
    for line in text.splitlines():
        if not line.startswith(' '):
            suite = line.split()[0] if line.strip() else suite
        elif suite and suite.endswith('.'):
            names.append(suite + line.split()[0])
    return names


class Suite:
    """Which tests of the programs reach which mutants, and how long each takes. Those that take longer than
    `slowest_s` are left out."""

    def __init__(self, programs: list, jobs: int, slowest_s: float):
        self.reached, self.seconds, self.reach = defaultdict(list), {}, {}
        tests = [(program, test) for program in programs for test in list_tests(program)]
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            for (program, test), (seconds, ids) in zip(tests, pool.map(lambda t: self.record(*t), tests)):
                self.seconds[(program, test)] = seconds
                self.reach[(program, test)] = len(ids)
                for mutant in ids if seconds <= slowest_s else ():
                    self.reached[mutant].append((program, test))

    @staticmethod
    def record(program: str, test: str):
        with tempfile.NamedTemporaryFile('r', suffix='.reached') as log:
            start = time.monotonic()
            if run_tests(program, [test], {'MUTANTS_REACHED': log.name}, 900) != 'passed':
                sys.exit(f'{test} of {program} fails without any mutant')
            return time.monotonic() - start, {int(line) for line in log.read().split()}

    def judge(self, mutant: int) -> str:
        """'killed', 'timed out', 'survived', or 'not reached'."""
        by_program = defaultdict(list)
        for program, test in self.reached.get(mutant, []):
            by_program[program].append(test)
        if not by_program:
            return 'not reached'
        for program, tests in by_program.items():
            for part in self.parts(program, tests):
                expected_s = sum(self.seconds[(program, test)] for test in part)
                outcome = run_tests(program, part, {'MUTANT': str(mutant)}, 20.0 + 10.0 * expected_s)
                if outcome != 'passed':
                    return 'killed' if outcome == 'failed' else outcome
        return 'survived'

    def parts(self, program: str, tests: list):
        """Those that reach the fewest places first, since they look at them; in parts, because most mutants die soon."""
        part, part_s, most_s = [], 0.0, 0.3
        for test in sorted(tests, key=lambda test: self.reach[(program, test)]):
            part.append(test)
            part_s += self.seconds[(program, test)]
            if part_s > most_s:
                yield part
                part, part_s, most_s = [], 0.0, 4.0 * most_s
        if part:
            yield part


def run(options) -> int:
    """Runs the tests on each mutant and writes the outcome after each, so that a stopped run goes on."""
    mutants = json.loads(Path(options.mutants).read_text())
    results = Path(options.out)
    done = {}
    if results.exists():
        done = {entry['id']: entry for entry in map(json.loads, results.read_text().splitlines())}
    chosen = [m for m in mutants if m['id'] not in done]
    if options.sample and options.sample < len(mutants):
        picked = set(random.Random(options.seed).sample(range(len(mutants)), options.sample))
        chosen = [m for m in chosen if m['id'] in picked]
    if options.only:
        again = set(options.only)
        chosen = [m for m in mutants if m['id'] in again]
    print(f'{len(chosen)} mutants to run; what each test reaches is found out first', flush=True)
    suite = Suite(options.program, options.jobs, options.slowest)
    with results.open('a') as out, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for number, (mutant, outcome) in enumerate(zip(chosen, pool.map(lambda m: suite.judge(m['id']), chosen)), 1):
            out.write(json.dumps({**mutant, 'outcome': outcome}) + '\n')
            out.flush()
            if number % 50 == 0:
                print(f'{number} of {len(chosen)}', flush=True)
    return 0


def report(options) -> int:
    """A table of the files and the list of the survivors, as Markdown."""
    outcomes = {entry['id']: entry for entry in map(json.loads, Path(options.results).read_text().splitlines())}
    by_file = defaultdict(list)
    for entry in outcomes.values():
        by_file[entry['file']].append(entry)
    print('| file | mutants | killed | survived | not reached | killed [%] |\n|---|---|---|---|---|---|')
    for path, entries in sorted(by_file.items()) + [('all', list(outcomes.values()))]:
        count = defaultdict(int)
        for entry in entries:
            count[entry['outcome']] += 1
        killed = count['killed'] + count['timed out']
        print(f'| {path} | {len(entries)} | {killed} | {count["survived"]} | {count["not reached"]} | '
              f'{100.0 * killed / len(entries):.1f} |')
    print()
    for path, entries in sorted(by_file.items()):
        for entry in sorted(entries, key=lambda e: (e['line'], e['id'])):
            if entry['outcome'] in ('survived', 'not reached'):
                print(f'- {path}:{entry["line"]} #{entry["id"]} {entry["outcome"]}: `{entry["what"]}`')
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    commands = parser.add_subparsers(dest='command', required=True)
    command = commands.add_parser('insert', help='put the mutants into the files')
    command.add_argument('--source', required=True)
    command.add_argument('--build', required=True, help='a configured build of it')
    command.add_argument('--out', required=True, help='what each mutant is, JSON')
    command.add_argument('folder', nargs='+', help='folders of src')
    command.set_defaults(function=insert)
    command = commands.add_parser('run', help='run the tests on each')
    command.add_argument('--mutants', required=True)
    command.add_argument('--out', required=True, help='outcomes, one JSON text a line; those that are there are kept')
    command.add_argument('--jobs', type=int, default=os.cpu_count())
    command.add_argument('--sample', type=int, default=0, help='as many, chosen at random')
    command.add_argument('--slowest', type=float, default=0.5, help='tests that take longer are left out [s]')
    command.add_argument('--seed', type=int, default=1)
    command.add_argument('--only', type=int, nargs='*', help='these again')
    command.add_argument('program', nargs='+', help='GoogleTest programs')
    command.set_defaults(function=run)
    command = commands.add_parser('report', help='print the table and the survivors')
    command.add_argument('results')
    command.set_defaults(function=report)
    options = parser.parse_args()
    return options.function(options)


if __name__ == '__main__':
    sys.exit(main())
