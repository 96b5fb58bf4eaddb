"""Expressions of the translated subset of Python (see `stillhook.kernels.c99.source`): each as a line of C with its
type."""

import ast
import functools
import inspect
import math
from collections import ChainMap
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.errors import StillhookError
from stillhook.kernels.lanes import Array
from stillhook.physics.records import fields, with_class
from stillhook.physics.scalar import bits, double, scalar_of


class SubsetError(StillhookError):
    """Source outside the translated subset of Python."""


LIBRARY = {
    abs: "fabs",
    math.fabs: "fabs",
    math.sqrt: "sqrt",
    math.ceil: "ceil",
    math.floor: "floor",
    math.copysign: "copysign",
    math.sin: "sin",
    math.cos: "cos",
}
BITS = {bits: ("bits_of", int), double: ("float_of", float)}
ARITHMETIC = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
COMPARISON = {ast.Lt: "<", ast.Gt: ">", ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
INTEGER_ONLY = {ast.FloorDiv: "floor_div", ast.Mod: "floor_mod", ast.LShift: "shift_left"}
FOLD: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
}
C_WORDS = frozenset(
    "auto break case char const continue default do double else enum extern float for goto if inline int long register"
    " restrict return short signed sizeof static struct switch typedef union unsigned void volatile while".split()
) | set(LIBRARY.values())


class Value(NamedTuple):
    """A C expression, its type, and its number where it is a constant."""

    text: str
    type: Any
    number: float | None = None


def constant(number: float) -> Value:
    """A literal that C reads as the same number."""
    if isinstance(number, int):
        return Value(str(number) if number >= 0 else f"({number})", int, number)
    text = repr(number).replace("inf", "INFINITY").replace("nan", "NAN")
    return Value(f"({text})" if text[0] == "-" else text, float, number)


def safe(name: str) -> str:
    return f"{name}_" if name in C_WORDS else name


def bare(text: str) -> str:
    """Without the outermost parentheses, where they enclose the whole."""
    if not (text.startswith("(") and text.endswith(")")):
        return text
    depth = 0
    for i, c in enumerate(text):
        depth += (c == "(") - (c == ")")
        if depth == 0:
            return text[1:-1] if i == len(text) - 1 else text
    return text


def plain(fn: Any) -> Callable[..., Any]:
    """The Python function that a kernel inlines for a scalar function, or that was compiled."""
    inlined = scalar_of(fn)
    source: Callable[..., Any] = inlined.source if inlined else getattr(fn, "py_func", fn)
    return source


@functools.cache
def names_of(fn: Callable[..., Any]) -> Mapping[str, Any]:
    """What the names that a function does not define stand for: those around it, then those of its module."""
    code = fn.__code__
    around = zip(code.co_freevars, fn.__closure__ or (), strict=True)
    return ChainMap({name: cell.cell_contents for name, cell in around}, fn.__globals__)


class Expressions:
    """The expressions of one function body; `t` is the Translator, `fn` the function, the dictionaries hold the types
    of its names."""

    t: Any
    fn: Callable[..., Any]
    args: dict[str, Any]
    local: dict[str, Any]
    loops: set[str]

    def refuse(self, node: Any, construct: str) -> Any:
        raise SubsetError(
            f"{self.fn.__code__.co_filename}:{node.lineno}: {construct} in {self.fn.__name__} cannot be translated to"
            " C. Allowed is the subset that stillhook.kernels.c99.source describes."
        )

    def expr(self, e: ast.expr) -> Value:
        method = getattr(self, f"expr_{type(e).__name__}", None)
        return Value(*(method(e) if method else self.refuse(e, f"the expression {type(e).__name__}")))

    def condition(self, e: ast.expr) -> str:
        v = self.expr(e)
        if v.type is not bool:
            self.refuse(e, "a condition that is a number")
        return v.text

    def number(self, e: ast.expr) -> Value:
        v = self.expr(e)
        if v.type not in (float, int):
            self.refuse(e, "arithmetic with anything but numbers")
        return v

    def static(self, e: ast.expr) -> Any:
        """The Python object that a global name or an attribute of a module stands for; None where there is none."""
        if isinstance(e, ast.Name) and not (e.id in self.args or e.id in self.local or e.id in self.loops):
            builtins = {"abs": abs, "range": range, "int": int, "min": min, "max": max}
            return names_of(self.fn).get(e.id, builtins.get(e.id))
        if isinstance(e, ast.Attribute) and inspect.ismodule(owner := self.static(e.value)):
            return getattr(owner, e.attr, None)
        return None

    def expr_Constant(self, e: ast.Constant) -> Value:
        if isinstance(e.value, bool):
            return Value(str(int(e.value)), bool)
        if type(e.value) not in (int, float):
            self.refuse(e, f"the constant {e.value!r}")
        return constant(e.value)  # type: ignore[arg-type]

    def expr_Name(self, e: ast.Name) -> Value:
        for names in (self.args, self.local):
            if e.id in names:
                return Value(safe(e.id), names[e.id])
        if e.id in self.loops:
            return Value(safe(e.id), int)
        known = self.static(e)
        if isinstance(known, np.ndarray) and known.ndim == 1:
            return Value(self.t.table(known), Array)
        if type(known) not in (int, float):
            self.refuse(e, f"the name {e.id}")
        return constant(known)

    def expr_Attribute(self, e: ast.Attribute) -> Value:
        known = self.static(e)
        if type(known) in (int, float):
            return constant(known)
        owner = self.expr(e.value)
        members = dict(fields(owner.type)) if hasattr(owner.type, "_fields") else {}
        if e.attr not in members:
            self.refuse(e, f"the attribute {e.attr}")
        return Value(f"{owner.text}.{safe(e.attr)}", members[e.attr])

    def expr_Subscript(self, e: ast.Subscript) -> Value:
        cut = e.slice if isinstance(e.slice, ast.Slice) else None
        if cut and (cut.lower is None or cut.upper or cut.step):
            self.refuse(e, "a slice other than A[i:]")
        array, i = self.expr(e.value), self.expr(cut.lower if cut and cut.lower else e.slice)
        if array.type is not Array or i.type is not int:
            self.refuse(e, "an index into anything but an array of floats")
        return (
            Value(f"({array.text} + {bare(i.text)})", Array) if cut else Value(f"{array.text}[{bare(i.text)}]", float)
        )

    def expr_BinOp(self, e: ast.BinOp) -> Value:
        a, b, op = self.number(e.left), self.number(e.right), type(e.op)
        both = int if a.type is int and b.type is int else float
        if a.number is not None and b.number is not None and op in FOLD:
            return constant(FOLD[op](a.number, b.number))
        if op is ast.Add and both is int and 0 in (a.number, b.number):
            return b if a.number == 0 else a
        if op in ARITHMETIC:
            return Value(f"({a.text} {ARITHMETIC[op]} {b.text})", both)
        if op is ast.Div:
            return Value(f"({'(double)' if both is int else ''}{a.text} / {b.text})", float)
        if op is ast.Pow and both is float:
            return Value(f"pow({a.text}, {b.text})", float)
        if op in INTEGER_ONLY and both is int:
            return Value(f"{INTEGER_ONLY[op]}({a.text}, {b.text})", int)
        return Value(*self.refuse(e, f"the operator {op.__name__} on these numbers"))

    def expr_UnaryOp(self, e: ast.UnaryOp) -> Value:
        if isinstance(e.op, ast.Not):
            return Value(f"(!{self.condition(e.operand)})", bool)
        v = self.number(e.operand)
        if not isinstance(e.op, ast.USub):
            self.refuse(e, f"the operator {type(e.op).__name__}")
        return constant(-v.number) if v.number is not None else Value(f"(-{v.text})", v.type)

    def expr_Compare(self, e: ast.Compare) -> Value:
        v = [self.number(x).text for x in (e.left, *e.comparators)]
        if any(type(op) not in COMPARISON for op in e.ops):
            self.refuse(e, "this comparison")
        pairs = [f"({a} {COMPARISON[type(o)]} {b})" for a, o, b in zip(v, e.ops, v[1:], strict=False)]
        return Value(f"({' && '.join(pairs)})" if len(pairs) > 1 else pairs[0], bool)

    def expr_BoolOp(self, e: ast.BoolOp) -> Value:
        operator = " && " if isinstance(e.op, ast.And) else " || "
        return Value(f"({operator.join(self.condition(v) for v in e.values)})", bool)

    def expr_IfExp(self, e: ast.IfExp) -> Value:
        a, b = self.expr(e.body), self.expr(e.orelse)
        if a.type != b.type and {a.type, b.type} != {int, float}:
            self.refuse(e, "a choice between two types")
        return Value(f"({self.condition(e.test)} ? {a.text} : {b.text})", a.type if a.type == b.type else float)

    def expr_Tuple(self, e: ast.Tuple) -> Value:
        v = [self.expr(x) for x in e.elts]
        t = tuple(x.type for x in v)
        return Value(f"(({self.t.ctype(t)}){{{', '.join(bare(x.text) for x in v)}}})", t)

    def expr_Call(self, e: ast.Call) -> Value:
        fn = self.static(e.func)
        if isinstance(fn, type) and hasattr(fn, "_fields"):
            return self.record(e, fn)
        values = [self.expr(a) for a in e.args]
        if e.keywords:
            self.refuse(e, "a call with keywords of anything but a NamedTuple")
        text = ", ".join(bare(v.text) for v in values)
        if fn in LIBRARY:
            return Value(f"{LIBRARY[fn]}({text})", float)
        if fn is int and len(values) == 1 and values[0].type in (float, int):
            return Value(f"((int64_t){values[0].text})", int)
        if fn in (min, max) and len(values) == 2 and values[0].type == values[1].type and not e.keywords:
            kind = "int" if values[0].type is int else "float"
            return Value(f"{fn.__name__}_{kind}({text})", values[0].type)
        if fn in BITS:
            return Value(f"{BITS[fn][0]}({text})", BITS[fn][1])
        if not inspect.isfunction(plain(fn)):
            self.refuse(e, f"the call of {ast.unparse(e.func)}")
        made = self.t.function(fn, tuple(v.type for v in values))
        return Value(f"{made.name}({text})", made.result)

    def record(self, e: ast.Call, cls: Any) -> Value:
        arguments = dict(zip(cls._fields, e.args, strict=False)) | {str(k.arg): k.value for k in e.keywords}
        if set(arguments) != set(cls._fields) or len(e.args) + len(e.keywords) != len(cls._fields):
            self.refuse(e, f"{cls.__name__} without all of its fields")
        members = []
        for name, t in fields(cls):
            v = self.expr(arguments[name])
            if t is not float and hasattr(v.type, "_fields"):
                cls = cls if v.type is t else with_class(cls, name, v.type)
            elif v.type != t and not (t is float and v.type is int):
                self.refuse(e, f"a value of another type for {cls.__name__}.{name}")
            members.append(f".{safe(name)} = {bare(v.text)}")
        return Value(f"(({self.t.ctype(cls)}){{{', '.join(members)}}})", cls)
