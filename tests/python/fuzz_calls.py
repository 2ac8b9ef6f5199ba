# SPDX-License-Identifier: BSD-3-Clause
"""Random calls of everything in dyop, made from the type stubs, in child processes.

Usage, with the built package on PYTHONPATH: fuzz_calls.py COUNT [SEED]

A child makes some hundred calls and writes each of them down before it is made. A crash, a call
that does not end and an exception of a wrong kind are printed with the call, and make the exit code
1. Arguments are of the wanted types, mostly, with values at the edges; results of calls are
arguments of later ones.
"""

import ast
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

CALLS_PER_CHILD = 200
PATIENCE = 300  # seconds for a child
CALL_SECONDS = 2  # after which a call is interrupted, as by Ctrl-C
FUNCTIONS = "<functions>"
# They start threads or processes, or wait for the user's.
SKIPPED = {"study"}
WRONG = ("Unable to cast", "incompatible function", "incompatible constructor", "pybind11", "std::")


class Interrupted(BaseException):
    """The call took too long, and obeyed."""


def read_stubs():
    """(class or FUNCTIONS, name, [(argument, annotation, has_default, is_keyword)]) of every call."""
    import dyop

    text = (Path(dyop.__file__).parent / "_dyop.pyi").read_text(encoding="utf-8")
    calls = []

    def add(owner, node):
        spec = node.args
        plain = [(a, i >= len(spec.args) - len(spec.defaults), False) for i, a in enumerate(spec.args)]
        named = [(a, d is not None, True) for a, d in zip(spec.kwonlyargs, spec.kw_defaults)]
        arguments = [
            (a.arg, a.annotation and ast.unparse(a.annotation), has_default, is_keyword)
            for a, has_default, is_keyword in plain + named
            if a.arg != "self"
        ]
        is_static = any(ast.unparse(d) == "staticmethod" for d in node.decorator_list)
        is_property = any(ast.unparse(d) == "property" for d in node.decorator_list)
        if not is_property and not any("setter" in ast.unparse(d) for d in node.decorator_list):
            calls.append((owner, node.name, arguments, is_static))

    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            add(FUNCTIONS, node)
        elif isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    add(node.name, member)
    return [call for call in calls if call[1] not in SKIPPED and call[1] != "__setstate__"]


class Values:
    """Values of any type that a stub names."""

    def __init__(self, generator, calls):
        import numpy

        import dyop

        self.dyop, self.numpy, self.random = dyop, numpy, generator
        self.pool = {}
        self.makers = {owner: args for owner, name, args, _ in calls if name == "__init__"}
        self.depth = 0

    def keep(self, value):
        for kind in type(value).__mro__[:-1]:
            if getattr(self.dyop, kind.__name__, None) is kind:
                known = self.pool.setdefault(kind.__name__, [])
                known.append(value)
                if len(known) > 20:
                    known.pop(self.random.randrange(20))

    def number(self):
        edges = [0.0, -0.0, 1.0, -1.0, 0.5, 1e-3, 2.0, 1e300, -1e300, 5e-324]
        edges += [float("inf"), float("-inf"), float("nan")]
        return self.random.choice(edges + [self.random.uniform(-3, 3)] * 12)

    def integer(self):
        return self.random.choice([0, 1, 2, 3, 5, 8, -1, 255, 2**31, 2**32, 2**63, -(2**63), 2**70])

    def text(self):
        return self.random.choice(
            ["", "a", "b", "none.json", "none.h5", "binary", "text.json", "stack", "x/y", "\0", "é", "\ud800"]
        )

    def array(self):
        shape = self.random.choice([(), (0,), (1,), (2,), (3,), (4,), (6,), (4, 4), (3, 3), (0, 3)] + [(5, 3)] * 4)
        kind = self.random.choice(["f8"] * 6 + ["f4", "i4", "i8", "O", "U3", "c16", "?"])
        if kind == "i4":
            values = self.numpy.array([self.random.randrange(-1, 6) for _ in range(30)])
        else:
            values = self.numpy.array([self.number() for _ in range(30)])
        size = int(self.numpy.prod(shape))
        with self.numpy.errstate(all="ignore"):
            made = self.numpy.resize(values[:size], shape).astype(kind)
        return made.tolist() if self.random.random() < 0.3 else made

    def pose(self):
        roll = self.random.random()
        if roll < 0.5:
            return self.dyop.RigidPose(position=[self.random.uniform(-3, 3) for _ in range(3)])
        if roll < 0.8:
            return ((1, 0, 0, 0), [self.number() for _ in range(3)])
        return self.random.choice([self.numpy.eye(4), self.numpy.eye(3), ([2, 0, 0, 0], [0, 0, 0]), self.array()])

    def function(self):
        answer = self.of(self.random.choice(["float", "bool", "_PoseLike", "_TwistLike", "None"]))
        def call(*arguments):
            if answer == "raise":
                raise KeyError("of the fuzzer")
            return answer
        return call

    def anything(self):
        kinds = ["int", "float", "str", "bool", "None", "ArrayLike", "_PoseLike", "Callable"]
        return self.of(self.random.choice(kinds + [k for k in self.pool if self.pool[k]]))

    def of(self, annotation):
        """A value of an annotation; now and then one of another."""
        if annotation is None or annotation == "Any" or self.random.random() < 0.04:
            return self.anything() if self.depth < 3 else None
        self.depth += 1
        try:
            return self.of_type(annotation)
        finally:
            self.depth -= 1

    def of_type(self, annotation):
        node = ast.parse(annotation, mode="eval").body
        if isinstance(node, ast.Subscript):
            return self.of_generic(node)
        name = ast.unparse(node)
        simple = {"float": self.number, "int": self.integer, "str": self.text, "_PoseLike": self.pose,
                  "ArrayLike": self.array, "bool": lambda: self.random.random() < 0.5,
                  "None": lambda: None, "Callable": self.function, "_IntervalLike": self.interval,
                  "object": self.anything, "bytes": lambda: b"a", "tuple": tuple, "list": list,
                  "_TwistLike": lambda: ([self.number() for _ in range(3)], [0, self.number(), 1]),
                  "_StateLike": lambda: (self.pose(), ((0, 0, 0), (0, 0, 1)))}
        if name in simple:
            return simple[name]()
        return self.instance(name)

    def of_generic(self, node):
        name = ast.unparse(node.value)
        inner = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
        inner = [ast.unparse(i) for i in inner]
        if name in ("Optional",):
            return None if self.random.random() < 0.4 else self.of(inner[0])
        if name == "Union":
            return self.of(self.random.choice(inner))
        if name in ("List", "list", "Sequence", "Iterable"):
            return [self.of(inner[0]) for _ in range(self.random.choice([0, 1, 2, 3, 6]))]
        if name in ("Tuple", "tuple"):
            return tuple(self.of(i) for i in inner if i != "...")
        if name == "Callable":
            return self.function()
        return self.array() if name == "NDArray" else self.anything()

    def interval(self):
        ends = self.random.choice([(0, 1), (0, 1), (0, 0.5), (self.number(), self.number())])
        return self.dyop.TimeInterval(*ends) if self.random.random() < 0.5 else ends

    def instance(self, name):
        kind = getattr(self.dyop, name, None)
        if kind is None:
            return None
        known = self.pool.get(name, [])
        if known and (self.random.random() < 0.7 or self.depth > 3):
            return self.random.choice(known)
        if hasattr(kind, "__members__"):
            return self.random.choice(list(kind.__members__.values()))
        if self.depth > 4 or name not in self.makers:
            return self.random.choice(known) if known else None
        positional, named = self.arguments(self.makers[name])
        try:
            made = kind(*positional, **named)
        except (Exception, Interrupted):
            return self.random.choice(known) if known else None
        self.keep(made)
        return made

    def arguments(self, wanted):
        positional, named = [], {}
        skipping = False
        for name, annotation, has_default, is_keyword in wanted:
            if has_default and self.random.random() < 0.6:
                skipping = True
                continue
            if is_keyword or skipping:
                named[name] = self.of(annotation)
            else:
                positional.append(self.of(annotation))
        if self.random.random() < 0.02:
            positional.append(self.anything())
        if self.random.random() < 0.02:
            named["nonsense"] = 1
        return positional, named


def starters(values):
    """What random arguments would seldom make."""
    dyop, numpy = values.dyop, values.numpy
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    mesh = dyop.TriangleMesh(numpy.array(corners, dtype=float), numpy.array(faces, dtype="i4"))
    chain = dyop.KinematicChain(
        [dyop.Link(name="a", shape=dyop.Sphere(0.1)), dyop.Link(name="b", shape=mesh)],
        [dyop.Joint(name="j", parent="a", child="b", X_PJ=((1, 0, 0, 0), (1, 0, 0)))],
    )
    world = dyop.World()
    world.add_body(dyop.BodyDefinition(
        name="ball", shape=dyop.Sphere(0.5), mass_properties=dyop.MassProperties(mass=1, I_BBcm=numpy.eye(3))
    ))
    obstacles = dyop.ObstacleSet()
    obstacles.add(mesh)
    return [
        mesh, chain, world, obstacles, dyop.Sphere(1), dyop.Box([1, 1, 1]), dyop.RestMotion(),
        dyop.make_robot("r", chain), dyop.JointPath.linear([0, 1], [[0], [1]]),
        dyop.ConstantTwistMotion(((1, 0, 0, 0), (3, 0, 0)), ((-1, 0, 0), (0, 0, 1))),
    ]


def describe(owner, name, target, positional, named):
    words = [repr(a)[:200] for a in positional] + [f"{k}={v!r}"[:200] for k, v in named.items()]
    place = "" if owner == FUNCTIONS else f"{owner}({target!r})."[:200]
    return f"{place}{name}({', '.join(words)})".replace("\n", " ").encode("ascii", "backslashreplace").decode()


def is_right(error):
    """Whether a caller may expect this kind of exception."""
    import dyop

    if isinstance(error, UnicodeError) and "surrogates not allowed" not in str(error):
        return False
    if any(wrong in str(error) for wrong in WRONG):
        return False
    kinds = (dyop.Error, TypeError, ValueError, LookupError, OverflowError, MemoryError, Interrupted)
    return isinstance(error, kinds) and not isinstance(error, dyop.InternalError)


def make_calls(count, seed, log):
    """The work of a child. Returns the number of wrong exceptions."""
    calls = read_stubs()
    generator = random.Random(seed)
    values = Values(generator, calls)
    for value in starters(values):
        values.keep(value)
    Path("binary").write_bytes(bytes(generator.randrange(256) for _ in range(300)))
    Path("text.json").write_text('{"bodies": [{"name": 3}]}')

    def interrupt(*_):
        raise Interrupted

    signal.signal(signal.SIGALRM, interrupt)
    wrong = 0
    for _ in range(count):
        owner, name, wanted, is_static = generator.choice(calls)
        # A deadline far away, as one that is close would make runs differ.
        try:
            signal.setitimer(signal.ITIMER_REAL, CALL_SECONDS)
            target = None
            if owner == FUNCTIONS:
                call = getattr(values.dyop, name)
            elif name == "__init__":
                call = getattr(values.dyop, owner)
            else:
                target = getattr(values.dyop, owner) if is_static else values.instance(owner)
                call = getattr(target, name, None)
                if target is None or call is None:
                    continue
            positional, named = values.arguments(wanted)
            words = describe(owner, name, target, positional, named)
            log.write(words + "\n")
            log.flush()
            result = call(*positional, **named)
            repr(result)
            values.keep(result)
        except BaseException as error:
            if not is_right(error):
                wrong += 1
                print(f"wrong exception: {type(error).__name__}: {error}\n  {words}", flush=True)
            # Whatever it was, its traceback keeps nothing alive.
            error.__traceback__ = None
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
    return wrong


def run_child(count, seed):
    """None if all is well, else what went wrong."""
    import dyop

    environment = dict(os.environ, PYTHONPATH=str(Path(dyop.__file__).resolve().parents[1]))
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "calls.log"
        inside = Path(folder) / "inside"
        inside.mkdir()
        command = [sys.executable, "-X", "faulthandler", os.path.abspath(__file__), "--child", str(count), str(seed), str(log)]
        try:
            done = subprocess.run(
                command, cwd=inside, env=environment, capture_output=True, text=True,
                timeout=PATIENCE, errors="replace",
            )
        except subprocess.TimeoutExpired:
            return f"seed {seed}: does not end:\n  {last_line(log)}"
        if done.returncode == 0:
            return None
        if done.returncode == 1:
            return f"seed {seed}: {done.stdout}{done.stderr[-2000:]}"
        return f"seed {seed}: ended with {done.returncode}:\n  {last_line(log)}\n{done.stderr[-2000:]}"


def last_line(log):
    lines = log.read_text().splitlines() if log.exists() else []
    return lines[-1] if lines else "(before the first call)"


def run(count, seed=0):
    """Makes about `count` calls; returns what went wrong, a text each."""
    problems = []
    for start in range(0, count, CALLS_PER_CHILD):
        problem = run_child(min(CALLS_PER_CHILD, count - start), seed + start)
        if problem is not None:
            problems.append(problem)
            print(problem, flush=True)
    return problems


def main(arguments):
    if arguments[:1] == ["--child"]:
        memory = 16 << 30  # address space; threads take most of it without using it
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        with open(arguments[3], "w", encoding="ascii") as log:
            return 1 if make_calls(int(arguments[1]), int(arguments[2]), log) > 0 else 0
    return 1 if run(*map(int, arguments)) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
