"""Fakes of the dashboard's tests have the members and signatures of what they stand for.

A fake that is out of date would let a page pass its tests with calls that the real thing refuses.
A member that a fake lacks needs no test: what uses it fails.
"""

import dis
import inspect

from plateviz.runs.kept_selections import KeptSelections
from plateviz.runs.run import Run
from plateviz.solving.judge import Judge
from plateviz.solving.solution_store import SolutionStore
from plateviz.solving.solver_pool import Solver
from tests.plateviz.cli.test_demo import DeadSolver, NoSolver
from tests.plateviz.dashboard.fake_store import FakeStore
from tests.plateviz.dashboard.fake_survey import FakeRun, SurveyStore
from tests.plateviz.dashboard.session.test_taken_up_fit import SharedStore
from tests.plateviz.dashboard.views.panes.test_compare_runs import ComparedRun
from tests.plateviz.dashboard.views.test_states import LostRun

# Members by which tests say what a fake does, or read what was asked of it.
OF_TESTS = {
    *("n_fitted", "read", "expected", "also_written", "is_lost", "n_read"),
    *("requested", "prepared", "cancelled", "abandoned", "left", "pauses", "is_shared", "jobs"),
}


def public(names):
    return {name for name in names if not name.startswith("_")}


def members(one):
    """Return the public members of a class: what it defines, and what its instances are given."""
    code = [
        parent.__init__.__code__ for parent in one.__mro__ if hasattr(parent.__init__, "__code__")
    ]
    found = [step for made in code for step in dis.get_instructions(made)]
    return public({*dir(one), *(step.argval for step in found if step.opname == "STORE_ATTR")})


def parameters(function):
    """Return name, kind and default of the parameters, without `self`."""
    found = inspect.signature(function).parameters.values()
    return [(one.name, one.kind, one.default) for one in found if one.name != "self"]


def fakes(fit_result, survey):
    run = "default", survey, fit_result
    for fake in (FakeRun, ComparedRun, LostRun):
        yield fake(*run), Run
    for store in (FakeStore(fit_result), SurveyStore(fit_result, []), SharedStore(fit_result)):
        yield store, SolutionStore
    yield store.selections, KeptSelections
    yield store.judge, Judge
    yield NoSolver(), Solver
    yield DeadSolver(), Solver


def test_fakes_have_the_members_of_what_they_stand_for(fit_result, survey):
    for fake, real in fakes(fit_result, survey):
        known = members(real)
        for name in public(dir(fake)) - OF_TESTS:
            assert name in known, f"{type(fake).__name__}.{name}: no member of {real.__name__}"


def test_methods_of_fakes_take_what_the_real_ones_take(fit_result, survey):
    for fake, real in fakes(fit_result, survey):
        for name in public(dir(fake)) - OF_TESTS:
            of_real, of_fake = inspect.getattr_static(real, name, None), getattr(fake, name)
            assert inspect.isfunction(of_real) == inspect.isroutine(of_fake), (real, name)
            if inspect.isfunction(of_real):
                assert parameters(of_fake) == parameters(of_real), (real, name)
