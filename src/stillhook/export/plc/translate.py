"""Equations of the controller as statements of Structured Text, translated from their Python source.

A function of numbers and structures to a number becomes a FUNCTION. One that takes or gives a record that is no
structure of the PLC is written out where it is called: functions that return structures are not accepted everywhere. A
conditional expression becomes IF ... END_IF, since SEL would calculate both of its values, and a division by zero
stops a PLC. Sums and products keep the order of the source.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

from stillhook.errors import StillhookError
from stillhook.export.plc.program import BOOL, LREAL, PREFIX, Names, Structure, Unit, Variable, literal, plain_text
from stillhook.kernels.c99.expressions import plain
from stillhook.kernels.c99.source import definitions, returns
from stillhook.physics.records import fields

ATOM, UNARY, PRODUCT, SUM, COMPARISON, AND, OR = 9, 8, 7, 6, 5, 4, 3
OPERATORS: dict[type, tuple[str, int]] = {
    ast.Add: ("+", SUM),
    ast.Sub: ("-", SUM),
    ast.Mult: ("*", PRODUCT),
    ast.Div: ("/", PRODUCT),
}
COMPARISONS: dict[type, str] = {
    ast.Lt: "<", ast.Gt: ">", ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "=", ast.NotEq: "<>"
}  # fmt: skip
STANDARD: dict[Any, str] = {abs: "ABS", math.fabs: "ABS", math.sqrt: "SQRT", math.sin: "SIN", math.cos: "COS"}
TYPES: dict[Any, str] = {float: LREAL, bool: BOOL}
WIDTH = 110


class TranslationError(StillhookError):
    """Source that has no form in Structured Text here."""


class Value(NamedTuple):
    """An expression, its type (float or bool) and how tightly its outermost operator binds."""

    text: str
    type: type
    binds: int = ATOM


class Record(NamedTuple):
    """A record: values of its fields, and its path where it is a structure of the PLC, else ""."""

    cls: Any
    values: dict[str, Any]
    path: str = ""


class Call(NamedTuple):
    """A function while it is translated, with the values of its names."""

    fn: Callable[..., Any]
    env: dict[str, Any]


def within(value: Value, binds: int) -> str:
    """The text of an operand, in parentheses where its operator would bind less tightly; signs always."""
    return value.text if value.binds >= binds and value.binds != UNARY else f"({value.text})"


def paragraphs(text: str) -> str:
    """A docstring as one paragraph a line."""
    return plain_text("\n".join(" ".join(part.split()) for part in inspect.cleandoc(text).split("\n\n")))


def documentation(fn: Callable[..., Any]) -> str:
    """Docstring of a function; a plain operation of the mathematics has none."""
    return paragraphs(fn.__doc__ or "")


def comment(text: str, pad: str = "") -> list[str]:
    """Comment lines; a text of the user, such as a crane's name, cannot end the comment."""
    lines = [part for line in plain_text(text).splitlines() for part in (textwrap.wrap(line, WIDTH) or [])]
    if not lines:
        return []
    lines[0], lines[1:] = f"(* {lines[0]}", [f"   {line}" for line in lines[1:]]
    lines[-1] += " *)"
    return [pad + line for line in lines]


class Library:
    """Structures and functions in the order in which a PLC wants them."""

    def __init__(self) -> None:
        self.names = Names()
        self.structures: dict[Any, Structure] = {}
        self.members: dict[Any, dict[str, str]] = {}
        self.functions: dict[Any, tuple[Unit, type]] = {}

    def structure(self, cls: Any, record: Any, text: str = "", notes: Any = None) -> str:
        """Name of the structure of a record, whose values are its members' first ones; text: its comment in place of
        the docstring; notes: comments on members, by class."""
        notes = notes or {}
        if cls not in self.structures:
            inner = {
                name: self.structure(t, getattr(record, name), "", notes)
                for name, t in fields(cls)
                if hasattr(t, "_fields")
            }
            beside = notes.get(cls, {})
            names = Names()
            spelled = {name: names.new(name) for name in cls._fields}
            self.members[cls] = spelled
            members = tuple(
                Variable(
                    spelled[name], inner.get(name, LREAL), beside.get(name, ""), "" if name in inner else literal(value)
                )
                for name, value in record._asdict().items()
            )
            about = text or paragraphs(cls.__doc__ or "")
            about = "" if about.startswith(f"{cls.__name__}(") else about
            self.structures[cls] = Structure(self.names.new(PREFIX + cls.__name__), about, members)
        return self.structures[cls].name

    def reference(self, cls: Any, path: str) -> Record:
        """A structure that the PLC holds."""
        spelled = self.members[cls]
        values = {
            name: self.reference(t, f"{path}.{spelled[name]}") if hasattr(t, "_fields")
            else Value(f"{path}.{spelled[name]}", float)
            for name, t in fields(cls)
        }  # fmt: skip
        return Record(cls, values, path)

    def function(self, fn: Callable[..., Any], arguments: list[Any]) -> tuple[Unit, type] | None:
        """The FUNCTION for arguments of these types; None where the function gives no single number."""
        types = tuple(a.cls if isinstance(a, Record) else a.type for a in arguments)
        key = (fn, types)
        if key not in self.functions:
            body = Body(self)
            names = list(inspect.signature(fn).parameters)
            inputs, env = [], {}
            for name, t in zip(names, types, strict=True):
                own = body.names.new(name)
                known = t in self.structures
                inputs.append(Variable(own, self.structures[t].name if known else TYPES[t]))
                env[name] = self.reference(t, own) if known else Value(own, t)
            result = body.run(fn, env)
            if not isinstance(result, Value):
                return None
            name = self.names.new(PREFIX + fn.__name__)
            body.emit(f"{name} := {result.text};")
            unit = Unit(
                name,
                "\n".join(part for part in (documentation(fn), f"Translated from {fn.__module__}.") if part),
                TYPES[result.type],
                tuple(inputs),
                (),
                tuple(body.variables),
                tuple(body.lines),
            )
            self.functions[key] = unit, result.type
        return self.functions[key]


class Body:
    """Statements of one function or of the block."""

    def __init__(self, library: Library, taken: Names | None = None) -> None:
        self.library = library
        self.names = taken or Names()
        self.lines: list[str] = []
        self.variables: list[Variable] = []
        self.depth = 0

    def emit(self, line: str) -> None:
        pad = "    " * self.depth
        self.lines += textwrap.wrap(
            line, WIDTH, initial_indent=pad, subsequent_indent=f"{pad}        ", break_long_words=False,
            break_on_hyphens=False,
        )  # fmt: skip

    def new(self, name: str, t: type) -> Value:
        own = self.names.new(name)
        self.variables.append(Variable(own, TYPES[t]))
        return Value(own, t)

    def kept(self, value: Any, name: str) -> Any:
        """A value that can be used any number of times: calculated once."""
        if isinstance(value, Record):
            if value.path:
                return value
            return Record(value.cls, {f: self.kept(v, f) for f, v in value.values.items()})
        if isinstance(value, tuple) and not isinstance(value, Value):
            return tuple(self.kept(v, f"{name}_{i}") for i, v in enumerate(value))
        if value.binds == ATOM and "(" not in value.text:
            return value
        target = self.new(name, value.type)
        self.emit(f"{target.text} := {value.text};")
        return target

    def choice(self, condition: Value, one: Callable[[], Any], other: Callable[[], Any], name: str) -> Any:
        """One of two values, of which only the one that is wanted is calculated."""
        self.emit(f"IF {condition.text} THEN")
        start = len(self.lines)
        self.depth += 1
        a = one()
        middle = len(self.lines)
        b = other()
        self.depth -= 1
        parts = (self.lines[start:middle], self.lines[middle:])
        del self.lines[start:]
        assigned: tuple[list[tuple[str, str]], list[tuple[str, str]]] = ([], [])
        result = self.merged(a, b, name, assigned)
        for lines, values in zip(parts, assigned, strict=True):
            if lines is parts[1]:
                self.emit("ELSE")
            self.lines += lines
            self.depth += 1
            for target, text in values:
                self.emit(f"{target} := {text};")
            self.depth -= 1
        self.emit("END_IF;")
        return result

    def merged(self, a: Any, b: Any, name: str, assigned: Any) -> Any:
        if isinstance(a, Record):
            return Record(a.cls, {f: self.merged(v, b.values[f], f, assigned) for f, v in a.values.items()})
        if isinstance(a, tuple) and not isinstance(a, Value):
            return tuple(self.merged(x, y, f"{name}_{i}", assigned) for i, (x, y) in enumerate(zip(a, b, strict=True)))
        if a == b and a.binds == ATOM:
            return a
        target = self.new(name, a.type)
        assigned[0].append((target.text, a.text))
        assigned[1].append((target.text, b.text))
        return target

    def run(self, fn: Callable[..., Any], env: dict[str, Any]) -> Any:
        """The result of a function, its statements written out here."""
        code = fn.__code__
        d = definitions(code.co_filename).get(code.co_firstlineno)
        if d is None:
            raise TranslationError(f"{code.co_filename}:{code.co_firstlineno}: {fn.__name__} has no source to read.")
        return self.block(d.body, Call(fn, env))

    def refuse(self, node: Any, call: Call, what: str) -> Any:
        raise TranslationError(
            f"{call.fn.__code__.co_filename}:{node.lineno}: {what} in {call.fn.__name__} cannot be written as"
            " Structured Text. Use numbers, records, + - * /, comparisons, if and else, abs, sqrt, sin and cos."
        )

    # Statements

    def block(self, statements: list[ast.stmt], call: Call) -> Any:
        """Result of the statements, None where they give none."""
        for i, s in enumerate(statements):
            if isinstance(s, ast.Return) and s.value is not None:
                return self.value(s.value, call)
            if isinstance(s, ast.If) and returns(s.body):
                others = [*s.orelse, *statements[i + 1 :]]
                one, two = Call(call.fn, dict(call.env)), Call(call.fn, dict(call.env))
                condition = self.value(s.test, call)
                return self.choice(
                    condition, partial(self.block, s.body, one), partial(self.block, others, two), "result"
                )
            self.statement(s, call)
        return None

    def statement(self, s: ast.stmt, call: Call) -> None:
        if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant):
            return
        if isinstance(s, ast.If):
            self.branch(s, call)
        elif isinstance(s, ast.Assign) and len(s.targets) == 1:
            self.assign(s.targets[0], s.value, call)
        elif isinstance(s, ast.AugAssign) and isinstance(s.target, ast.Name):
            read = ast.Name(s.target.id, ast.Load())
            value = ast.copy_location(ast.BinOp(ast.copy_location(read, s), s.op, s.value), s)
            self.assign(s.target, value, call)
        else:
            self.refuse(s, call, f"the statement {type(s).__name__}")

    def branch(self, s: ast.If, call: Call) -> None:
        """Names that either way changes get a new value after it."""
        changed = sorted(
            {n.id for part in (*s.body, *s.orelse) for n in ast.walk(part)
             if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        )  # fmt: skip
        ways = (Call(call.fn, dict(call.env)), Call(call.fn, dict(call.env)))

        def way(body: list[ast.stmt], own: Call) -> Any:
            if any(isinstance(n, ast.Return) for part in body for n in ast.walk(part)):
                self.refuse(s, call, "a return in one of several ways")
            self.block(body, own)
            lacking = [name for name in changed if name not in own.env]
            if lacking:
                self.refuse(s, call, f"{lacking[0]}, which only one way defines,")
            return tuple(own.env[name] for name in changed)

        condition = self.value(s.test, call)
        name = changed[0] if len(changed) == 1 else "chosen"
        results = self.choice(condition, lambda: way(s.body, ways[0]), lambda: way(s.orelse, ways[1]), name)
        call.env.update(zip(changed, results, strict=True))

    def assign(self, target: ast.expr, value: ast.expr, call: Call) -> None:
        if isinstance(target, ast.Name):
            call.env[target.id] = self.kept(self.value(value, call, target.id), target.id)
        elif isinstance(target, ast.Tuple) and all(isinstance(t, ast.Name) for t in target.elts):
            names = [t.id for t in target.elts if isinstance(t, ast.Name)]
            parts = self.value(value, call)
            if isinstance(parts, Value | Record) or len(parts) != len(names):
                self.refuse(value, call, "unpacking of anything but a tuple")
            parts = [self.kept(p, n) for n, p in zip(names, parts, strict=True)]
            call.env.update(zip(names, parts, strict=True))
        else:
            self.refuse(target, call, "an assignment to anything but names")

    # Expressions

    def value(self, e: ast.expr, call: Call, name: str = "") -> Any:
        """Value of an expression; name: what a variable for it may be called."""
        method = getattr(self, f"value_{type(e).__name__}", None)
        if method is None:
            return self.refuse(e, call, f"the expression {type(e).__name__}")
        if isinstance(e, ast.IfExp | ast.BoolOp):
            return method(e, call, name)
        return method(e, call)

    def number(self, e: ast.expr, call: Call, t: type = float) -> Value:
        v = self.value(e, call)
        if not isinstance(v, Value) or v.type is not t:
            self.refuse(e, call, "a number where a truth value is wanted, or the reverse,")
        return Value(*v)

    def static(self, e: ast.expr, call: Call) -> Any:
        """The Python object that a name outside of the function stands for."""
        if isinstance(e, ast.Name) and e.id not in call.env:
            return call.fn.__globals__.get(e.id, {"abs": abs}.get(e.id))
        if isinstance(e, ast.Attribute) and inspect.ismodule(owner := self.static(e.value, call)):
            return getattr(owner, e.attr, None)
        return None

    def value_Constant(self, e: ast.Constant, call: Call) -> Value:
        return self.constant(e.value, e, call)

    def constant(self, number: Any, e: ast.expr, call: Call) -> Value:
        if isinstance(number, bool):
            return Value("TRUE" if number else "FALSE", bool)
        if not isinstance(number, int | float) or not math.isfinite(number):
            self.refuse(e, call, f"the constant {number!r}")
        return Value(literal(number), float, UNARY if number < 0.0 else ATOM)

    def value_Name(self, e: ast.Name, call: Call) -> Any:
        if e.id in call.env:
            return call.env[e.id]
        return self.constant(self.static(e, call), e, call)

    def value_Attribute(self, e: ast.Attribute, call: Call) -> Any:
        known = self.static(e, call)
        if isinstance(known, int | float):
            return self.constant(known, e, call)
        owner = self.value(e.value, call)
        if not isinstance(owner, Record) or e.attr not in owner.values:
            self.refuse(e, call, f"the attribute {e.attr}")
        return owner.values[e.attr]

    def value_BinOp(self, e: ast.BinOp, call: Call) -> Value:
        if type(e.op) not in OPERATORS:
            self.refuse(e, call, f"the operator {type(e.op).__name__}")
        sign, binds = OPERATORS[type(e.op)]
        a, b = self.number(e.left, call), self.number(e.right, call)
        return Value(f"{within(a, binds)} {sign} {within(b, binds + 1)}", float, binds)

    def value_UnaryOp(self, e: ast.UnaryOp, call: Call) -> Value:
        if isinstance(e.op, ast.Not):
            return Value(f"NOT {within(self.number(e.operand, call, bool), ATOM)}", bool, UNARY)
        if not isinstance(e.op, ast.USub):
            self.refuse(e, call, f"the operator {type(e.op).__name__}")
        return Value(f"-{within(self.number(e.operand, call), ATOM)}", float, UNARY)

    def value_Compare(self, e: ast.Compare, call: Call) -> Value:
        if any(type(op) not in COMPARISONS for op in e.ops):
            self.refuse(e, call, "this comparison")
        terms = [self.number(x, call) for x in (e.left, *e.comparators)]
        pairs = zip(terms, e.ops, terms[1:], strict=False)
        texts = [f"{within(a, SUM)} {COMPARISONS[type(o)]} {within(b, SUM)}" for a, o, b in pairs]
        if len(texts) == 1:
            return Value(texts[0], bool, COMPARISON)
        return Value(" AND ".join(f"({t})" for t in texts), bool, AND)

    def value_BoolOp(self, e: ast.BoolOp, call: Call, name: str) -> Value:
        """Python stops at the first term that decides; where a later one calls or divides, so does this."""
        conjunction = isinstance(e.op, ast.And)
        if not any(isinstance(n, ast.Div | ast.IfExp | ast.Call) for v in e.values[1:] for n in ast.walk(v)):
            terms = [within(self.number(v, call, bool), ATOM) for v in e.values]
            return Value((" AND " if conjunction else " OR ").join(terms), bool, AND if conjunction else OR)
        result = self.number(e.values[0], call, bool)
        for term in e.values[1:]:

            def more(term: ast.expr = term) -> Value:
                return self.number(term, call, bool)

            def decided() -> Value:
                return Value("FALSE" if conjunction else "TRUE", bool)

            one, other = (more, decided) if conjunction else (decided, more)
            result = self.choice(result, one, other, name or "holds")
        return result

    def value_IfExp(self, e: ast.IfExp, call: Call, name: str) -> Any:
        condition = self.number(e.test, call, bool)
        return self.choice(
            condition, lambda: self.value(e.body, call), lambda: self.value(e.orelse, call), name or "chosen"
        )

    def value_Tuple(self, e: ast.Tuple, call: Call) -> Any:
        return tuple(self.value(x, call) for x in e.elts)

    def value_Call(self, e: ast.Call, call: Call) -> Any:
        fn = self.static(e.func, call)
        if isinstance(fn, type) and hasattr(fn, "_fields"):
            return self.record(e, fn, call)
        if e.keywords:
            self.refuse(e, call, "a call with keywords of anything but a NamedTuple")
        arguments = [self.value(a, call) for a in e.args]
        if fn in STANDARD and len(arguments) == 1:
            return Value(f"{STANDARD[fn]}({arguments[0].text})", float)
        if not inspect.isfunction(plain(fn)) or not hasattr(fn, "scalar"):
            self.refuse(e, call, f"the call of {ast.unparse(e.func)}")
        return self.called(plain(fn), arguments)

    def called(self, fn: Callable[..., Any], arguments: list[Any]) -> Any:
        """A FUNCTION where there can be one, else its statements here."""
        library = self.library
        if all(isinstance(a, Value) or (isinstance(a, Record) and a.path) for a in arguments):
            made = library.function(fn, arguments)
            if made is not None:
                unit, t = made
                texts = [a.path if isinstance(a, Record) else a.text for a in arguments]
                given = ", ".join(f"{v.name} := {x}" for v, x in zip(unit.inputs, texts, strict=True))
                return Value(f"{unit.name}({given})", t)
        names = list(inspect.signature(fn).parameters)
        env = {name: self.kept(a, name) for name, a in zip(names, arguments, strict=True)}
        if text := documentation(fn):
            self.lines += comment(f"{fn.__name__}: {text}", "    " * self.depth)
        return self.run(fn, env)

    def record(self, e: ast.Call, cls: Any, call: Call) -> Record:
        given = dict(zip(cls._fields, e.args, strict=False)) | {str(k.arg): k.value for k in e.keywords}
        if set(given) != set(cls._fields):
            self.refuse(e, call, f"{cls.__name__} without all of its fields")
        values = {name: self.kept(self.value(given[name], call, name), name) for name in cls._fields}
        return Record(cls, values)


def scalars(record: Record, prefix: str = "") -> Iterator[tuple[str, Value]]:
    """Every number of a record by its path."""
    for name, value in record.values.items():
        if isinstance(value, Record):
            yield from scalars(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
