"""The report's statistics on synthetic data whose answers are known.

Coverage: of many data sets drawn from one law, the share whose 95 % interval holds the true value. It must be what a
binomial variable of that probability can be; seeds are fixed, so a test passes always or never.
"""
import numpy as np
import pytest
from crackle.files.run_file import triangular_network
from crackle.statistics.avalanches import (AvalancheModel, avalanche_sizes, binned_density, choose_s_min,
                                           fit_avalanches, fit_avalanches_resampled, log_bins, size_counts)
from crackle.statistics.bootstrap import interval, resampling_weights, weighted_means
from crackle.statistics.collapse import Curve, best_collapse, quality
from crackle.statistics.damage_profiles import (average_profile, bond_sections, centred, fourier_magnitudes,
                                                segment_counts, uncorrelated_magnitude)
from crackle.statistics.goodness import compare, goodness, spread_integers
from crackle.statistics.scaling import LOGARITHMIC_LAW, POWER_LAW, SHIFTED_POWER_LAW, fit_law, fit_resampled
from crackle.statistics.strength_fits import FAMILIES, fit_gumbel, fit_weakest_link, fit_weibull
from crackle.study.analysis import rescale_avalanches
from scipy.stats import binom


def assert_covers(held, of, probability=0.95):
    """held of `of` intervals hold the truth: neither too few nor too many, at 1 in 1000 (both sides together)."""
    low, high = binom.ppf([0.0005, 0.9995], of, probability)
    assert low <= held <= high, f"{held} of {of} intervals hold the true value, not {low:.0f} to {high:.0f}"


# Avalanches

@pytest.mark.parametrize("load, sizes", [
    ([1, 2, 3], [1, 1, 1]), ([3, 2, 1], [3]), ([1, 0.5, 2, 1, 1.9, 3, 0], [2, 3, 2]), ([1, 1, 2], [2, 1]), ([], [])])
def test_avalanche_starts_where_the_load_exceeds_all_before(load, sizes):
    np.testing.assert_array_equal(avalanche_sizes(load), sizes)


def test_last_avalanche_is_not_counted():
    counts = size_counts([np.array([1, 1, 3, 40]), np.array([7]), np.array([2, 5])]).toarray()
    np.testing.assert_array_equal(counts, [[0, 2, 0, 1], [0, 0, 0, 0], [0, 0, 1, 0]])


def draw_avalanches(random, tau, cutoff, bonds, samples, each):
    """Counts [samples, bonds + 1] of Poisson(each) avalanches a sample from s^-tau exp(-s/cutoff)."""
    s = np.arange(1, bonds + 1)
    p = s ** -tau * np.exp(-s / cutoff)
    sizes = random.choice(s, size=random.poisson(each * samples), p=p / p.sum())
    counts = np.zeros((samples, bonds + 1))
    np.add.at(counts, (random.integers(samples, size=len(sizes)), sizes), 1)
    return counts


def test_intervals_of_tau_hold_it():
    random = np.random.default_rng(5)
    held, sets, bonds = 0, 60, 400
    for seed in range(sets):
        counts = draw_avalanches(random, 2.5, 25.0, bonds, samples=100, each=20)
        fit = fit_avalanches([counts.sum(axis=0)], [bonds], s_min=1)
        resampled = weighted_means(resampling_weights(100, 80, seed), counts)
        low, high = interval(fit_avalanches_resampled([resampled], [bonds], fit)[:, 0])
        held += low <= 2.5 <= high
    assert_covers(held, sets)


def test_tau_dimension_and_amplitude_of_several_sizes():
    random = np.random.default_rng(6)
    bonds = np.array([225, 833, 3201, 12545])
    counts = [draw_avalanches(random, 2.5, 0.5 * n ** 0.55, n, 1, 300000)[0] for n in bonds]
    fit = fit_avalanches(counts, bonds, s_min=2)
    assert fit.tau == pytest.approx(2.5, abs=0.026)  # four standard errors, of 20 such data sets
    assert fit.dimension == pytest.approx(1.1, abs=0.12) and np.log(2 * fit.amplitude) == pytest.approx(0, abs=0.33)
    assert fit.score < 1.5


def test_gradient_of_the_avalanche_likelihood():
    random = np.random.default_rng(7)
    bonds = [225, 833]
    model = AvalancheModel([draw_avalanches(random, 2.2, 12.0, n, 1, 500)[0] for n in bonds], bonds, s_min=2)
    at = np.array([2.1, 0.4, 0.9])
    _, gradient = model.cost(at)
    for i, h in enumerate(1e-5 * np.eye(3)):
        assert gradient[i] == pytest.approx((model.cost(at + h)[0] - model.cost(at - h)[0]) / 2e-5, abs=1e-7)


def test_s_min_is_where_the_law_begins():
    """Too many single breaks: the law holds from 3 on."""
    random = np.random.default_rng(8)
    counts = draw_avalanches(random, 2.5, 50.0, 3000, 1, 40000)[0]
    counts[1:3] *= 1.5
    fit, fits = choose_s_min([counts], [3000])
    assert fit.s_min == 3 and fit.score < 0.9 and len(fits) > 3
    assert fit.tau == pytest.approx(2.5, abs=0.1)


def test_binned_density_is_a_probability():
    counts = np.bincount(np.random.default_rng(9).geometric(0.05, 5000))
    edges = log_bins(len(counts) - 1)
    centre, density = binned_density(counts, edges)
    assert edges[0] == 1 and np.all(np.diff(edges) >= 1)
    assert np.sum(density * np.diff(edges)) == pytest.approx(1)
    assert np.all(centre >= edges[:-1]) and np.all(centre <= edges[1:])
    np.testing.assert_allclose(density[0], counts[1] / 5000)


# Scaling with size

def test_intervals_of_b_hold_it():
    random = np.random.default_rng(11)
    bonds = np.array([833.0, 1825, 3201, 12545])
    held, sets = 0, 80
    for seed in range(sets):
        samples = [0.18 * n ** 0.92 * np.exp(random.normal(0, 0.1, 60) - 0.005) for n in bonds]
        resampled = np.stack([weighted_means(resampling_weights(60, 100, [seed, i]), v)
                              for i, v in enumerate(samples)], axis=1)
        _, exponent = fit_resampled(POWER_LAW, bonds, [v.mean() for v in samples], resampled)
        held += exponent.low <= 0.92 <= exponent.high
    assert_covers(held, sets)


@pytest.mark.parametrize("law, exponent, coefficients", [
    (POWER_LAW, 0.92, [0.2]), (SHIFTED_POWER_LAW, 0.97, [0.14, 0.7]), (LOGARITHMIC_LAW, 0.15, [0.16, 0.6])])
def test_law_without_noise_is_recovered(law, exponent, coefficients):
    x = np.array([8.0, 16, 24, 32, 64, 128])
    y = law.basis(x, exponent) @ coefficients
    fit = fit_law(law, x, y, 1e-3 * y)
    assert fit.exponent == pytest.approx(exponent, abs=1e-5)
    np.testing.assert_allclose(fit.coefficients, coefficients, rtol=1e-3)
    assert fit.chi_squared < 1e-6 and fit.degrees == len(x) - law.coefficients - 1


def test_chi_squared_rejects_a_law_that_does_not_hold():
    x = np.array([8.0, 16, 32, 64, 128])
    y = SHIFTED_POWER_LAW.basis(x, 1.0) @ [0.14, 0.7]
    assert fit_law(POWER_LAW, x, y, 0.01 * y).p_value < 1e-6
    assert fit_law(SHIFTED_POWER_LAW, x, y, 0.01 * y).p_value > 0.99


def test_law_with_too_few_sizes_is_refused():
    with pytest.raises(ValueError, match="3 sizes are needed, 2 there"):
        fit_law(SHIFTED_POWER_LAW, [8, 16], [1, 2], [0.1, 0.1])


# Strength

def test_intervals_of_the_lognormal_parameters_hold_them():
    random = np.random.default_rng(13)
    held, sets, n = np.zeros(2), 300, 150
    for seed in range(sets):
        log = random.normal(-1.7, 0.12, n)
        mean, square = weighted_means(resampling_weights(n, 200, seed), np.stack([log, log ** 2], axis=1)).T
        for i, (resampled, truth) in enumerate(((mean, -1.7), (np.sqrt(square - mean ** 2), 0.12))):
            low, high = interval(resampled)
            held[i] += low <= truth <= high
    for count in held:  # percentile intervals of 150 samples hold a little less than 95 %
        assert_covers(count, sets, probability=0.935)


DRAWN = {  # family to 8000 strengths
    "normal": lambda random: random.normal(0.18, 0.02, 8000),
    "lognormal": lambda random: np.exp(random.normal(-1.7, 0.15, 8000)),
    "Weibull": lambda random: 0.2 * random.weibull(8, 8000),
    "modified Gumbel": lambda random: 0.2 * (np.log(50 / random.exponential(size=8000)).clip(0.1) / 5) ** (-1 / 2.0),
}


@pytest.mark.parametrize("family", DRAWN)
def test_family_is_recognised(family):
    """Its own fit is not rejected; the lognormal one is, if it is another, and loses the likelihood ratio."""
    sigma = DRAWN[family](np.random.default_rng(17))
    own = goodness(sigma, FAMILIES[family], draws=99)
    assert own.ks_p > 0.02 and own.ad_p > 0.02
    other = "Weibull" if family == "lognormal" else "lognormal"
    wrong = goodness(sigma, FAMILIES[other], draws=99)
    assert wrong.ad_p <= 0.01 and wrong.ad > 5 * own.ad
    test = compare(sigma, FAMILIES[family](sigma), FAMILIES[other](sigma))
    assert test.ratio > 0 and test.p_value < 0.01
    back = compare(sigma, FAMILIES[other](sigma), FAMILIES[family](sigma))
    assert back.ratio == pytest.approx(-test.ratio) and back.p_value == pytest.approx(test.p_value)


@pytest.mark.parametrize("family", FAMILIES)
def test_distribution_is_whole(family):
    """Its density is the derivative of its cumulative distribution; what it draws follows it."""
    random = np.random.default_rng(19)
    fitted = FAMILIES[family](DRAWN[family](random))
    sigma = np.linspace(0.13, 0.24, 50)
    slope = (fitted.cdf(sigma + 1e-6) - fitted.cdf(sigma - 1e-6)) / 2e-6
    np.testing.assert_allclose(np.exp(fitted.log_density(sigma)), slope, rtol=1e-4, atol=1e-6)
    drawn = np.sort(fitted.draw(random, 4000))
    distance = np.max(np.abs(fitted.cdf(drawn) - (np.arange(4000) + 0.5) / 4000))
    assert distance < 1.95 / np.sqrt(4000)


def test_weibull_and_gumbel_parameters_are_recovered():
    random = np.random.default_rng(23)
    weibull = fit_weibull(0.2 * random.weibull(8, 20000)).parameters
    assert weibull["m"] == pytest.approx(8, rel=0.03) and weibull["scale"] == pytest.approx(0.2, rel=0.005)
    gumbel = fit_gumbel(DRAWN["modified Gumbel"](random)).parameters
    assert gumbel["delta"] == pytest.approx(2.0, abs=0.6)


def test_weakest_link_law_of_all_sizes():
    """1 - P = exp(-L^2 c sigma^m): one m and c for three sizes."""
    random = np.random.default_rng(29)
    sizes, m, c = [8, 16, 32], 6.0, 4.0
    strengths = [(random.exponential(size=5000) / (c * L ** 2)) ** (1 / m) for L in sizes]
    law = fit_weakest_link(strengths, sizes, gumbel=False)
    assert law.k == pytest.approx(m, rel=0.02)
    assert law.log_c - m * np.log(law.unit) == pytest.approx(np.log(c), abs=0.3)


def test_p_values_are_uniform_under_the_null():
    random = np.random.default_rng(31)
    p = [goodness(random.normal(3, 2, 40), FAMILIES["normal"], seed, draws=39).ad_p for seed in range(100)]
    for level in (0.1, 0.5):
        low, high = binom.ppf([0.001, 0.999], 100, level)
        assert low <= np.sum(np.array(p) <= level) <= high


def test_integers_spread_over_their_steps_are_not_taken_for_a_misfit():
    counts = np.round(np.random.default_rng(37).normal(27, 4, 5000)).astype(int)
    assert goodness(counts.astype(float), FAMILIES["normal"], draws=49).ks_p <= 0.02
    assert goodness(spread_integers(counts), FAMILIES["normal"], draws=49).ks_p > 0.05
    np.testing.assert_array_equal(np.round(spread_integers(counts)), counts)


# Collapse

def collapsing_curves(random, noise):
    """Curves ln P against ln s with tau = 2.5 and D = 1.1, cut off exponentially."""
    curves = []
    for bonds in (833.0, 3201.0, 12545.0):
        s = np.geomspace(2, 3 * bonds ** 0.55, 15)
        y = -2.5 * np.log(s) - s / bonds ** 0.55
        curves.append(Curve(bonds, np.log(s), y + noise * random.normal(size=len(s)), np.full(len(s), noise)))
    return curves


def test_collapse_finds_its_exponents():
    random = np.random.default_rng(41)
    curves = collapsing_curves(random, 0.03)
    best = best_collapse(curves, rescale_avalanches, [2.2, 0.9], [0.2, 0.2])
    np.testing.assert_allclose(best.exponents, [2.5, 1.1], atol=0.08)
    assert 0.3 < best.quality < 2.5


def test_quality_tells_a_collapse_from_none():
    curves = collapsing_curves(np.random.default_rng(43), 0.03)
    assert quality([rescale_avalanches(c, (2.5, 1.1)) for c in curves]) < 2.5
    assert quality([rescale_avalanches(c, (2.5, 0.2)) for c in curves]) > 20
    assert quality([rescale_avalanches(c, (2.5, 30.0)) for c in curves]) == np.inf


# Damage profiles

def test_sections_are_rows_of_nodes():
    network = triangular_network(6, 0.8, components=2)
    section = bond_sections(network, 0.8)
    np.testing.assert_array_equal(np.bincount(section), [3 * 7] * 6 + [7])


def test_centred_profiles_have_their_mass_in_the_middle():
    counts = np.zeros((3, 9), int)
    counts[0, 1:4] = [1, 2, 1]
    counts[1, 8] = 5
    counts[2, 4] = 7
    shifted = centred(counts)
    np.testing.assert_array_equal(np.nan_to_num(shifted)[0], [0, 0, 0, 1, 2, 1, 0, 0, 0])
    assert shifted[1, 4] == 5 and np.isnan(shifted[1, 5:]).all() and not np.isnan(shifted[1, :5]).any()
    mean = average_profile(shifted, np.ones((1, 3)))[0]
    assert mean[4] == pytest.approx((2 + 5 + 7) / 3) and mean[5] == pytest.approx(0.5)


def test_fourier_magnitudes_of_uniform_and_of_localised_damage():
    random = np.random.default_rng(47)
    uniform = np.stack([np.bincount(random.integers(32, size=400), minlength=32) for _ in range(2000)])
    assert fourier_magnitudes(uniform)[:, :-1].mean() == pytest.approx(uncorrelated_magnitude(400), rel=0.02)
    np.testing.assert_allclose(fourier_magnitudes(np.eye(8, dtype=int)[[3]]), 1)
    np.testing.assert_allclose(fourier_magnitudes(np.full((1, 8), 2)), 0, atol=1e-12)


def test_segments_hold_every_break_once():
    section = np.arange(40) // 4
    bonds = np.random.default_rng(53).permutation(40)[:35]
    before, after = segment_counts(bonds, 20, section, 10)
    assert before.shape == after.shape == (6, 10)
    np.testing.assert_array_equal(before.sum(axis=0), np.bincount(section[bonds[:20]], minlength=10))
    np.testing.assert_array_equal(after.sum(axis=1), [3, 3, 3, 2, 2, 2])
