"""Figures: pure functions from the tables of `plateviz.tables` to HoloViews objects.

Imports `plateviz.tables`. Every `plot_<noun>(table, *, options)` returns an object for the Bokeh
backend, an empty and titled one for an empty table. Dashboard, notebooks and reports share them.
"""

from plateviz.plots.comparison import (
    plot_comparison,
    plot_comparison_histogram,
    plot_comparison_map,
)
from plateviz.plots.convergence import plot_convergence
from plateviz.plots.deviation import plot_deviation
from plateviz.plots.distortion import plot_distortion
from plateviz.plots.eigenmode_groups import plot_eigenmode_groups
from plateviz.plots.eigenmode_shifts import plot_eigenmode_shifts
from plateviz.plots.eigenmodes import plot_eigenmode_deciders, plot_eigenmode_spectrum
from plateviz.plots.error_by_count import plot_error_by_count
from plateviz.plots.footprint import plot_footprint
from plateviz.plots.motion_pulls import plot_motion_pulls
from plateviz.plots.orbit_counts import plot_orbit_counts
from plateviz.plots.orbit_health import plot_orbit_health
from plateviz.plots.orders import plot_orders
from plateviz.plots.prior_separation import plot_prior_separation
from plateviz.plots.prior_shares import plot_prior_shares
from plateviz.plots.pulls import plot_exposure_chi2, plot_pulls
from plateviz.plots.reference_scatter import plot_reference_scatter
from plateviz.plots.residual_map import plot_residual_map
from plateviz.plots.residual_scatter import plot_residual_scatter
from plateviz.plots.sky_distribution import plot_sky_distribution
from plateviz.plots.sky_track import plot_sky_track
from plateviz.plots.time_series import plot_time_series
from plateviz.plots.uncertainty import plot_uncertainty

__all__ = [
    "plot_comparison",
    "plot_comparison_histogram",
    "plot_comparison_map",
    "plot_convergence",
    "plot_deviation",
    "plot_distortion",
    "plot_error_by_count",
    "plot_exposure_chi2",
    "plot_footprint",
    "plot_eigenmode_deciders",
    "plot_eigenmode_groups",
    "plot_eigenmode_shifts",
    "plot_eigenmode_spectrum",
    "plot_motion_pulls",
    "plot_orbit_counts",
    "plot_orbit_health",
    "plot_orders",
    "plot_prior_separation",
    "plot_prior_shares",
    "plot_pulls",
    "plot_reference_scatter",
    "plot_residual_map",
    "plot_residual_scatter",
    "plot_sky_distribution",
    "plot_sky_track",
    "plot_time_series",
    "plot_uncertainty",
]
