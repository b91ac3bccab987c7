"""Results as tidy tables, one function per figure: the source of every displayed number.

Imports `solver` only. The truth is a frame with `source_id`, `ra` and `dec` (deg, direction at
the mean epoch of the orbit, without aberration), or None. A table that needs the truth is empty
if it is None.
"""

from plateviz.tables.binned_residuals import BinStatistics, bin_statistics, binned_residuals
from plateviz.tables.calibration import calibration_tables, distortion
from plateviz.tables.calibration_trends import calibration_trends
from plateviz.tables.comparison import comparison, difference_histogram
from plateviz.tables.convergence import convergence, loss_excess
from plateviz.tables.detector_shifts import (
    ShiftStatistics,
    detector_shifts,
    shift_statistics,
)
from plateviz.tables.distortion_comparison import distortion_comparison, distortion_truth
from plateviz.tables.eigenmodes import (
    eigenmode_deciders,
    eigenmode_groups,
    eigenmode_shifts,
    eigenmode_spectrum,
)
from plateviz.tables.exposure_tracks import exposure_tracks
from plateviz.tables.field_residuals import (
    FieldStatistics,
    field_residuals,
    field_statistics,
)
from plateviz.tables.footprint import footprint_fields, footprint_sources
from plateviz.tables.histogram import pull_bins
from plateviz.tables.largest_residuals import largest_residuals
from plateviz.tables.mean_residuals import (
    MapStatistics,
    detector_statistics,
    map_statistics,
    mean_residuals,
)
from plateviz.tables.motion_differences import motion_differences, shared_motions
from plateviz.tables.motion_pulls import motion_pulls
from plateviz.tables.orbit_counts import orbit_counts
from plateviz.tables.orbit_health import orbit_health
from plateviz.tables.orders import order_comparison, order_verdict
from plateviz.tables.outliers import outlier_list
from plateviz.tables.prior_separation import prior_separation, prior_separation_histogram
from plateviz.tables.prior_shares import prior_shares
from plateviz.tables.pulls import exposure_chi2, pull_histogram
from plateviz.tables.reference_fields import (
    ReferenceFieldsStatistics,
    reference_fields,
    reference_fields_statistics,
)
from plateviz.tables.reference_influence import reference_influence
from plateviz.tables.reference_scatter import reference_scatter, scatter_cells
from plateviz.tables.reproduction import reproduction
from plateviz.tables.residual_correlation import (
    CorrelationStatistics,
    correlation_statistics,
    residual_correlation,
)
from plateviz.tables.residual_tails import kurtosis_by_group, residual_tails
from plateviz.tables.residuals import (
    ScatterStatistics,
    binned_vectors,
    residual_map,
    residual_scatter,
    scatter_statistics,
)
from plateviz.tables.run_health import orbit_list, orbit_states, run_strip
from plateviz.tables.selected_exposures import selected_detectors, selected_exposures
from plateviz.tables.selected_sources import selected_sources
from plateviz.tables.sky_distribution import sky_density, sky_distribution
from plateviz.tables.sky_track import TrackStatistics, sky_track, track_statistics
from plateviz.tables.source_profile import (
    motion_in_words,
    motion_table,
    source_class,
    source_list,
    source_orbits,
    source_strip,
)
from plateviz.tables.source_track import source_curves, source_track
from plateviz.tables.sources import (
    ARTIFICIAL,
    CLASSES,
    NON_REFERENCE,
    REFERENCE,
    deviation,
    deviation_statistics,
    uncertainty,
    uncertainty_by_count,
)
from plateviz.tables.summary import SummaryItem, summary_strip
from plateviz.tables.time_series import time_series
from plateviz.tables.zonal_errors import ZonalStatistics, zonal_errors, zonal_statistics
from solver.model.apparent_motion import julian_year

__all__ = [
    "ARTIFICIAL",
    "BinStatistics",
    "CLASSES",
    "CorrelationStatistics",
    "FieldStatistics",
    "MapStatistics",
    "NON_REFERENCE",
    "REFERENCE",
    "ReferenceFieldsStatistics",
    "ScatterStatistics",
    "ShiftStatistics",
    "SummaryItem",
    "TrackStatistics",
    "bin_statistics",
    "binned_residuals",
    "binned_vectors",
    "calibration_tables",
    "calibration_trends",
    "comparison",
    "convergence",
    "correlation_statistics",
    "detector_shifts",
    "detector_statistics",
    "deviation",
    "deviation_statistics",
    "difference_histogram",
    "distortion",
    "distortion_comparison",
    "distortion_truth",
    "exposure_chi2",
    "exposure_tracks",
    "field_residuals",
    "field_statistics",
    "footprint_fields",
    "footprint_sources",
    "julian_year",
    "kurtosis_by_group",
    "largest_residuals",
    "loss_excess",
    "eigenmode_deciders",
    "eigenmode_groups",
    "eigenmode_shifts",
    "eigenmode_spectrum",
    "map_statistics",
    "mean_residuals",
    "motion_differences",
    "motion_pulls",
    "motion_in_words",
    "motion_table",
    "orbit_counts",
    "orbit_health",
    "orbit_list",
    "orbit_states",
    "order_comparison",
    "order_verdict",
    "outlier_list",
    "prior_separation",
    "prior_separation_histogram",
    "prior_shares",
    "pull_bins",
    "pull_histogram",
    "reference_fields",
    "reference_fields_statistics",
    "reference_influence",
    "reference_scatter",
    "reproduction",
    "residual_correlation",
    "residual_map",
    "residual_scatter",
    "residual_tails",
    "run_strip",
    "scatter_cells",
    "scatter_statistics",
    "selected_detectors",
    "selected_exposures",
    "selected_sources",
    "shared_motions",
    "shift_statistics",
    "sky_density",
    "sky_distribution",
    "sky_track",
    "source_class",
    "source_curves",
    "source_list",
    "source_orbits",
    "source_strip",
    "source_track",
    "summary_strip",
    "time_series",
    "track_statistics",
    "uncertainty",
    "uncertainty_by_count",
    "ZonalStatistics",
    "zonal_errors",
    "zonal_statistics",
]
