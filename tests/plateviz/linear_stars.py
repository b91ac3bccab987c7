"""A dense linear problem of stars, whose solution without any prior is a second inversion."""

import numpy as np
import pandas as pd

N_STARS, N_SHARED, N_ROWS = 40, 9, 30


class LinearStars:
    """A dense linear problem: stars with correlated priors, and parameters that all share."""

    def __init__(self, seed=0, wrong=None):
        """Draw it; the catalogue position of star `wrong` is off by that much, mas."""
        random = np.random.default_rng(seed)
        size = 2 * N_STARS + N_SHARED
        self.design = np.zeros((N_STARS * N_ROWS, size))
        for star in range(N_STARS):
            rows = slice(star * N_ROWS, (star + 1) * N_ROWS)
            self.design[rows, 2 * star : 2 * star + 2] = random.normal(0.0, 0.4, (N_ROWS, 2))
            self.design[rows, 2 * N_STARS :] = random.normal(0.0, 0.3, (N_ROWS, N_SHARED))
        sigma = random.uniform(0.3, 1.0, (N_STARS, 2))
        both = random.uniform(-0.7, 0.7, N_STARS) * sigma.prod(axis=1)
        self.prior = np.array(
            [((s[0] ** 2, c), (c, s[1] ** 2)) for s, c in zip(sigma, both, strict=True)]
        )
        truth = np.array([random.multivariate_normal((0.0, 0.0), p) for p in self.prior])
        star, by = wrong or (0, (0.0, 0.0))
        truth[star] -= by
        shared = random.normal(0.0, 1.0, N_SHARED)
        noise = random.normal(0.0, 1.0, len(self.design))
        self.data = self.design @ np.concatenate([truth.ravel(), shared]) + noise

    def solve(self, *, without=None):
        """Return estimates and covariances of the stars; `without` the prior of one of them."""
        normal = self.design.T @ self.design
        for star in range(N_STARS):
            if star != without:
                part = slice(2 * star, 2 * star + 2)
                normal[part, part] += np.linalg.inv(self.prior[star])
        covariance = np.linalg.inv(normal)
        places = (covariance @ self.design.T @ self.data)[: 2 * N_STARS].reshape(-1, 2)
        blocks = [covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(N_STARS)]
        return places, np.array(blocks)

    def sources(self, ids=range(N_STARS)):
        """Return the stars as reference sources, with columns of `schema.SOURCES`."""
        places, covariance = self.solve()
        sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        prior = np.sqrt(np.diagonal(self.prior, axis1=1, axis2=2))
        return pd.DataFrame(
            {
                "source_id": list(ids),
                "is_reference": True,
                "n_obs": N_ROWS,
                "offset_ra": places[:, 0],
                "offset_dec": places[:, 1],
                "prior_sigma_ra": prior[:, 0],
                "prior_sigma_dec": prior[:, 1],
                "prior_corr": self.prior[:, 0, 1] / prior.prod(axis=1),
                "sigma_ra_marginal": sigma[:, 0],
                "sigma_dec_marginal": sigma[:, 1],
                "corr_marginal": covariance[:, 0, 1] / sigma.prod(axis=1),
            }
        )
