import unittest

from plots import fig_parameters as count


class ParametersTest(unittest.TestCase):
    """Against the authors' networks and `option2vec params`."""

    def test_counts_of_four_options(self):
        for counted, expected in (
                (count.ppo(17, 6, 64), 11_085),
                (count.ppo(17, 6, 128), 38_541),
                (count.option_network(17, 6, 4, 64), 55_809),
                (count.option_network(17, 6, 4, 128), 193_473),
                (count.onestep_released(17, 6, 4, 64), 57_321),
                (count.onestep_released(17, 6, 4, 128), 195_049),
                (count.onestep_paper(17, 6, 4, 64), 34_232),
                (count.onestep_paper(17, 6, 4, 128), 117_560),
                (count.option2vec_released(17, 6, 4, 64), 30_598),
                (count.option2vec_paper(17, 6, 4, 64), 31_615)):
            self.assertEqual(counted, expected)

    def test_counts_of_another_task(self):
        # Humanoid-v2: S = 376, A = 17.
        self.assertEqual(count.option2vec_released(376, 17, 4, 64), 116_752)
        self.assertEqual(count.option2vec_paper(376, 17, 4, 64), 116_333)
        self.assertEqual(count.option_network(376, 17, 4, 128), 658_713)

    def test_an_option_costs_a_column_here_and_two_networks_there(self):
        # Option2Vec, released: D + 65 of the initial net + 2 D + 1 logits + 65 of the critic = 251.
        ours = [count.option2vec_released(17, 6, K, 64) for K in (4, 5)]
        self.assertEqual(ours[1] - ours[0], 40 + 65 + 81 + 65)
        theirs = [count.option_network(17, 6, K, 64) for K in (4, 5)]
        self.assertEqual(theirs[1] - theirs[0], 2 * count.body(17, 64) + 3 * 65 + 6 * 65 + 65 + 6)


if __name__ == "__main__":
    unittest.main()
