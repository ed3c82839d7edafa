import math
import unittest

import numpy as np
from scipy import stats

from plots.statistics import (Moments, Scores, bootstrap, holm, improvement, iqm, mean_improvement,
                              one_sample, seeds_needed, welch)


class MomentsTest(unittest.TestCase):
    def test_standard_deviation_has_divisor_n(self):
        m = Moments.of([1, 2, 3, 6])  # mean 3, squares 4 + 1 + 0 + 9 = 14
        self.assertEqual((m.mean, m.std, m.n), (3, math.sqrt(14 / 4), 4))


class IqmTest(unittest.TestCase):
    def test_is_the_mean_of_the_middle_half(self):
        # Of four values the middle two; of five, [1.25, 3.75) takes 3/4 of the second and the
        # fourth and the whole third: (0.75 * 2 + 3 + 0.75 * 10) / 2.5; of one, that one.
        self.assertEqual(iqm([0, 1, 3, 100]), 2)
        self.assertAlmostEqual(float(iqm([10, -50, 3, 2, 400])), 4.8)
        self.assertEqual(iqm([7.0]), 7)

    def test_is_scipys_trimmed_mean_where_four_divides_n(self):
        x = np.random.default_rng(1).normal(size=(3, 12))
        np.testing.assert_allclose(iqm(x), stats.trim_mean(x, 0.25, axis=1), rtol=1e-12)

    def test_works_along_any_axis(self):
        x = np.random.default_rng(2).normal(size=(5, 3))
        np.testing.assert_allclose(iqm(x, axis=0), [iqm(column) for column in x.T], rtol=1e-12)


class ImprovementTest(unittest.TestCase):
    def test_counts_pairs_and_half_of_ties(self):
        # 3 beats 1 and 2 and ties with 3; 1 ties with 1: (2 + 1/2 + 1/2) / 6.
        self.assertAlmostEqual(float(improvement([3, 1], [1, 2, 3])), 0.5)
        self.assertEqual(improvement([2, 3], [0, 1]), 1)

    def test_is_mann_whitneys_u(self):
        rng = np.random.default_rng(3)
        x, y = rng.integers(0, 6, 9), rng.integers(1, 7, 7)  # with ties
        self.assertAlmostEqual(float(improvement(x, y)),
                               stats.mannwhitneyu(x, y).statistic / (9 * 7))

    def test_of_tasks_is_the_mean_over_tasks(self):
        value = mean_improvement(np.array([1]), np.array([0]), np.array([0]), np.array([0, 1]))
        self.assertAlmostEqual(float(value), (1 + 0.25) / 2)

    def test_of_tasks_pairs_the_two_samples_of_a_task(self):
        # 3 never beats 5; 4 beats 1 and ties with 4: (0 + 3/4) / 2. First halves against second
        # ones give (0 + 1) / 2, the rival's side 1 - 3/8.
        samples = [np.array([3]), np.array([5]), np.array([4]), np.array([1, 4])]
        self.assertEqual(float(mean_improvement(*samples)), 0.375)
        # Along another axis the same: samples as columns.
        self.assertEqual(float(mean_improvement(*[s[:, None] for s in samples], axis=0)[0]), 0.375)


class HolmTest(unittest.TestCase):
    def test_worked_example(self):
        # Sorted 0.01, 0.02, 0.02, 0.6 times 4, 3, 2, 1: 0.04, 0.06, 0.04 (not below 0.06), 0.6.
        np.testing.assert_allclose(holm([0.6, 0.02, 0.01, 0.02]), [0.6, 0.06, 0.04, 0.06])

    def test_one_is_left_where_two_are_below_the_level(self):
        # Sorted 0.001, 0.03, 0.04 times 3, 2, 1: 0.003, 0.06, 0.04 (not below 0.06).
        np.testing.assert_allclose(holm([0.03, 0.001, 0.04]), [0.06, 0.003, 0.06])

    def test_is_at_most_one(self):
        np.testing.assert_array_equal(holm([0.7, 0.9]), [1, 1])


class WelchTest(unittest.TestCase):
    X, Y = np.arange(1.0, 6), np.array([2.0, 4, 6, 8])

    def test_worked_example(self):
        # Variances 2.5 and 20/3, of the means 0.5 and 5/3: t = -2 / sqrt(13/6), and the degrees
        # of freedom (13/6)^2 / (0.5^2/4 + (5/3)^2/3) = 4.75.
        d = welch(Moments.of(self.X), Moments.of(self.Y))
        dof = (13 / 6)**2 / (0.25 / 4 + (25 / 9) / 3)
        self.assertAlmostEqual(d.p, 2 * stats.t.sf(2 / math.sqrt(13 / 6), dof))
        half = stats.t.ppf(0.975, dof) * math.sqrt(13 / 6)
        np.testing.assert_allclose(d.interval, (-2 - half, -2 + half))
        self.assertFalse(d.above or d.below)

    def test_is_scipys(self):
        rng = np.random.default_rng(4)
        for n, m in ((2, 3), (5, 10), (10, 10)):
            x, y = rng.normal(size=n), rng.normal(1, 3, size=m)
            self.assertAlmostEqual(welch(Moments.of(x), Moments.of(y)).p,
                                   stats.ttest_ind(x, y, equal_var=False).pvalue)

    def test_the_intervals_ends_are_just_not_significant(self):
        low, _ = welch(Moments.of(self.X), Moments.of(self.Y)).interval
        self.assertAlmostEqual(welch(Moments.of(self.X - low), Moments.of(self.Y)).p, 0.05)

    def test_one_seed_decides_nothing(self):
        d = welch(Moments(5, 0, 1), Moments(1, 1, 10))
        self.assertTrue(math.isnan(d.p) and not d.above and not d.below)

    def test_constant_samples_differ_or_do_not(self):
        self.assertTrue(welch(Moments(2, 0, 3), Moments(1, 0, 3)).above)
        self.assertEqual(welch(Moments(1, 0, 3), Moments(1, 0, 3)).p, 1)

    def test_one_sample_is_scipys(self):
        d = one_sample(Moments.of(self.X))
        reference = stats.ttest_1samp(self.X, 0)
        self.assertAlmostEqual(d.p, reference.pvalue)
        np.testing.assert_allclose(d.interval, reference.confidence_interval(0.95))


class BootstrapTest(unittest.TestCase):
    def test_depends_on_the_data_only(self):
        x = np.random.default_rng(5).normal(size=10)
        first = bootstrap(iqm, x)
        np.random.default_rng().normal(size=100)
        bootstrap(iqm, x + 1)
        self.assertEqual(bootstrap(iqm, x), first)

    def test_resamples_every_sample_by_itself(self):
        # Constant strata have one resample each, whatever lies between them.
        samples = [np.full(5, 10.0), np.full(5, 0.0), np.full(4, 3.0), np.full(6, 7.0)]
        self.assertEqual(bootstrap(mean_improvement, *samples), (0.5, 0.5))

    def test_samples_of_equal_size_are_not_paired(self):
        # Resamples (1, 1) against (3, 3) and the other way round have probability 1/16 each, more
        # than 2.5 %. Paired by position, both samples would always be the same: 1/2.
        x = np.array([1.0, 3])
        self.assertEqual(bootstrap(improvement, x, x), (0, 1))

    def test_resamples_the_two_samples_of_each_task(self):
        # As above for each task, and (0, 0) and (1, 1) for both with 1/16: the whole range. First
        # halves against second ones would always lose.
        samples = [np.array(x, dtype=float) for x in ([1, 3], [2, 2], [5, 7], [6, 6])]
        self.assertEqual(bootstrap(mean_improvement, *samples), (0, 1))

    def test_of_a_mean_comes_near_the_normal_interval(self):
        x = np.random.default_rng(6).normal(size=400)
        low, high = bootstrap(np.mean, x)
        half = 1.96 * x.std() / 20
        self.assertAlmostEqual(low, x.mean() - half, delta=0.15 * half)
        self.assertAlmostEqual(high, x.mean() + half, delta=0.15 * half)

    def test_of_two_values_it_is_enumerated(self):
        # Resamples of [1, 3] have means 1, 2, 3 with probabilities 1/4, 1/2, 1/4, so that the 2.5
        # and 97.5 percentiles are the outer two; against [2, 2] these win never, half, always.
        self.assertEqual(bootstrap(np.mean, np.array([1.0, 3])), (1, 3))
        self.assertEqual(bootstrap(improvement, np.array([1.0, 3]), np.array([2.0, 2])), (0, 1))

    def test_of_three_values_it_is_enumerated(self):
        # Of 27 resamples of [0, 3, 9] one has the mean 0 and one 9: 1/27 > 2.5 %, both are in.
        self.assertEqual(bootstrap(np.mean, np.array([0.0, 3, 9])), (0, 9))
        # Of [0, 1] in 6 places 1/64 < 2.5 % has none, 7/64 > 2.5 % at most one of the ones.
        low, high = bootstrap(np.mean, np.array([0.0, 0, 0, 1, 1, 1]))
        self.assertAlmostEqual(low, 1 / 6)
        self.assertAlmostEqual(high, 5 / 6)

    def test_one_seed_has_no_interval(self):
        self.assertTrue(math.isnan(bootstrap(iqm, np.array([1.0]))[0]))


class ScoresTest(unittest.TestCase):
    def test_a_score_is_in_units_of_the_rivals_mean(self):
        # (12 - 10) / 10 and (14 - 10) / 10; the rival's mean -4: (-6 + 4) / 4 and (-2 + 4) / 4.
        scores = Scores.of([(np.array([12.0, 14]), np.array([9.0, 11])),
                            (np.array([-6.0, -2]), np.array([-4.0, -4]))])
        np.testing.assert_allclose(scores.runs, [[0.2, 0.4], [-0.5, 0.5]])
        np.testing.assert_allclose([mean for mean, _ in scores.means()], [0.3, 0])
        # Sorted -0.5, 0.2, 0.4, 0.5: the middle half is 0.2 and 0.4.
        self.assertAlmostEqual(scores.iqm()[0], 0.3)

    def test_the_rivals_runs_are_drawn_again_too(self):
        # One run of the method against [1, 3]: means 1, 2, 3 with 1/4, 1/2, 1/4, scores of 6 are
        # 5, 2, 1; the 2.5 and 97.5 percentiles are the outer two.
        scores = Scores.of([(np.array([6.0, 6]), np.array([1.0, 3]))])
        (mean, (low, high)), = scores.means()
        self.assertEqual((mean, low, high), (2, 1, 5))

    def test_tasks_and_methods_are_strata(self):
        # Every task has both of its runs alike, so that no resample differs, whatever the tasks'.
        scores = Scores.of([(np.array([2.0, 2]), np.array([1.0, 1])),
                            (np.array([9.0, 9]), np.array([1.0, 1]))])
        value, interval = scores.iqm()
        self.assertEqual((value, interval), (4.5, (4.5, 4.5)))  # of 1, 1, 8, 8

    def test_the_profile_is_the_share_above_a_threshold_and_tasks_count_alike(self):
        # Scores 0, 1 of one task, 2 alone of the other: above 0.5 a half and all, mean 3/4.
        scores = Scores.of([(np.array([1.0, 2]), np.array([1.0, 1])),
                            (np.array([3.0]), np.array([1.0]))])
        share, band = scores.profile(np.array([-0.5, 0, 0.5, 1.5, 2]))
        np.testing.assert_allclose(share, [1, 0.75, 0.75, 0.5, 0])
        np.testing.assert_allclose(band[:, 2], [0.5, 1])  # of two draws none, one or both are 1

    def test_a_single_run_has_no_interval(self):
        (_, (low, high)), = Scores.of([(np.array([3.0]), np.array([1.0, 2]))]).means()
        self.assertTrue(math.isnan(low) and math.isnan(high))


class SeedsNeededTest(unittest.TestCase):
    def test_one_deviation_takes_seventeen(self):
        # The textbook's number of a two-sample t test at 5 % with 80 % power, d = 1.
        one = math.sqrt(9 / 10)  # divisor n of a sample variance of 1
        self.assertEqual(seeds_needed(Moments(1, one, 10), Moments(0, one, 10)), 17)

    def test_equal_means_are_never_told_apart(self):
        self.assertIsNone(seeds_needed(Moments(1, 1, 5), Moments(1, 1, 5)))
        self.assertIsNone(seeds_needed(Moments(1.001, 1, 5), Moments(1, 1, 5)))


if __name__ == "__main__":
    unittest.main()
