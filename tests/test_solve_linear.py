"""Matrices, bordered systems and eigenvalues against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from oracles.toys import Dense, Toy
from stripfold.base.errors import SolveError
from stripfold.solve.linear import Band, BandPattern, Bordered, solve_bordered
from stripfold.solve.stability import nearest_eigenvalues

SIZE, NODES = 60, 5


def assembled(seed: int, shift: float = 0.0) -> tuple[Band, np.ndarray]:
    """A symmetric band matrix of overlapping random elements, and the same summed densely.

    Positive definite for ``shift`` = 0; the shift is taken off the diagonal.
    """
    rng = np.random.default_rng(seed)
    starts = np.arange(0, SIZE - NODES + 1, 2)
    unknowns = starts[:, None] + np.arange(NODES)
    unknowns[-1] = np.arange(SIZE - NODES, SIZE)
    half = rng.standard_normal((len(starts), NODES, NODES))
    elements = half @ half.transpose(0, 2, 1)
    dense = np.zeros((SIZE, SIZE))
    for at, element in zip(unknowns, elements, strict=True):
        dense[np.ix_(at, at)] += element
    pattern = BandPattern.of(unknowns, SIZE)
    band = pattern.assemble(elements)
    band.diagonal()[:] -= shift
    return band, dense - shift * np.eye(SIZE)


def shift_between(seed: int, negatives: int) -> float:
    """A shift that leaves so many negative eigenvalues, halfway between two of them."""
    values = np.linalg.eigvalsh(assembled(seed)[1])
    return 0.0 if negatives == 0 else float(values[negatives - 1 : negatives + 1].mean())


def symmetric(values: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A dense symmetric matrix with given eigenvalues, and its eigenvectors."""
    q = np.linalg.qr(np.random.default_rng(seed).standard_normal((len(values), len(values))))[0]
    return (q * values) @ q.T, q


class TestBand:
    """The band storage does what a dense matrix does; truth: numpy on the dense sum of the same elements."""

    @pytest.mark.parametrize("negatives", [0, 1, 7])
    def test_matvec_factor_and_count(self, negatives):
        band, dense = assembled(3, shift_between(3, negatives))
        x = np.random.default_rng(1).standard_normal(SIZE)
        np.testing.assert_array_equal(band.to_sparse().toarray(), dense)
        some = np.array([0, 17, SIZE - 1])
        np.testing.assert_array_equal(band.rows(some), dense[some])
        np.testing.assert_allclose(band @ x, dense @ x, atol=1e-13)
        np.testing.assert_allclose((band + band.scaled(-0.5)) @ x, 0.5 * dense @ x, atol=1e-13)
        np.testing.assert_allclose(abs(band) @ np.abs(x), np.abs(dense) @ np.abs(x), atol=1e-13)
        np.testing.assert_array_equal(band.diagonal(), np.diag(dense))
        before = band.flat.copy()
        solved = band.factor()(x)
        np.testing.assert_array_equal(band.flat, before)
        np.testing.assert_allclose(solved, np.linalg.solve(dense, x), rtol=1e-9)
        np.testing.assert_allclose(Dense(dense).factor()(x), np.linalg.solve(dense, x), rtol=1e-9)
        assert np.sum(np.linalg.eigvalsh(dense) < 0.0) == negatives
        assert band.negatives() == Dense(dense).negatives() == negatives

    def test_it_is_not_assumed_to_be_symmetric(self):
        """The printed law's tangent is not: matrix times vector and factorisation must not mix up its halves."""
        rng = np.random.default_rng(5)
        unknowns = np.arange(0, 12, 3)[:, None] + np.arange(5)
        elements = rng.standard_normal((4, 5, 5)) + 8.0 * np.eye(5)
        dense = np.zeros((14, 14))
        for at, element in zip(unknowns, elements, strict=True):
            dense[np.ix_(at, at)] += element
        band, x = BandPattern.of(unknowns, 14).assemble(elements), rng.standard_normal(14)
        np.testing.assert_allclose(band @ x, dense @ x, atol=1e-13)
        np.testing.assert_allclose(band.factor()(x), np.linalg.solve(dense, x), atol=1e-13)
        np.testing.assert_array_equal(band.to_sparse().toarray(), dense)

    @pytest.mark.parametrize("negatives", [0, 3])
    @pytest.mark.parametrize("fixed", [[], [0], [SIZE - 1, 4], [0, 1, 2, 30, 31, SIZE - 1]])
    def test_fixed_unknowns(self, fixed, negatives):
        """Truth: rows and columns of the identity times something positive; the rest of the matrix untouched."""
        fixed = np.array(fixed, dtype=np.intp)
        band, dense = assembled(4, shift_between(4, negatives))
        free = np.setdiff1d(np.arange(SIZE), fixed)
        for kept in (band.with_fixed(fixed).to_sparse().toarray(), Dense(dense).with_fixed(fixed).a):
            np.testing.assert_array_equal(kept[np.ix_(free, free)], dense[np.ix_(free, free)])
            assert not kept[np.ix_(free, fixed)].any()
            assert not kept[np.ix_(fixed, free)].any()
            assert np.all(np.diag(kept)[fixed] > 0.0)
        wanted = np.sum(np.linalg.eigvalsh(dense[np.ix_(free, free)]) < 0.0)
        assert band.with_fixed(fixed).negatives() == Dense(dense).with_fixed(fixed).negatives() == wanted
        rhs = np.random.default_rng(2).standard_normal(SIZE)
        rhs[fixed] = 0.0
        solved = band.with_fixed(fixed).factor()(rhs)
        assert not solved[fixed].any()
        np.testing.assert_allclose(solved[free], np.linalg.solve(dense[np.ix_(free, free)], rhs[free]), rtol=1e-9)
        np.testing.assert_array_equal(band.to_sparse().toarray(), dense)

    @pytest.mark.parametrize("index", [0, 1, 5])
    @pytest.mark.parametrize("distance", [1e-4, 1e-6])
    def test_inertia_beside_an_eigenvalue(self, index, distance):
        """Truth: the count rises by one as the shift passes an eigenvalue, down to 1e-6 of it (docs/method.md)."""
        values = np.linalg.eigvalsh(assembled(6)[1])
        for sign, wanted in ((-1.0, index), (1.0, index + 1)):
            band, dense = assembled(6, values[index] * (1.0 + sign * distance))
            assert band.negatives() == wanted
            assert Dense(dense).negatives() == wanted

    @pytest.mark.parametrize("make", [Dense, lambda a: BandPattern.of(np.arange(4)[None], 4).assemble(a[None])])
    def test_an_exactly_singular_matrix_is_refused(self, make):
        """A typed error, not a vector of infinities."""
        with pytest.raises(SolveError, match="singular"):
            make(np.diag([1.0, 2.0, 0.0, 3.0])).factor()


class TestBordered:
    """Truth: numpy on the whole matrix of one more row and column."""

    @pytest.mark.parametrize("smallest", [1.0, 1e-4, 1e-8, 1e-12, -1e-12, 1e-14])
    def test_nearly_singular(self, smallest):
        """At a fold K is singular, the bordered matrix is not: figures must not be lost."""
        n = 30
        rng = np.random.default_rng(8)
        k, vectors = symmetric(np.r_[smallest, np.linspace(0.5, 40.0, n - 1)])
        # Borders with a share of the null vector, as the load and the tangent have at a fold.
        column, row = vectors[:, 0] + 0.3 * rng.standard_normal(n), vectors[:, 0] + 0.3 * rng.standard_normal(n)
        whole = np.block([[k, column[:, None]], [row, np.array(0.7)]])
        assert np.linalg.cond(whole) < 1e3
        exact = rng.standard_normal(n + 1)
        rhs = whole @ exact
        matrix = Dense(k)
        x, y = solve_bordered(matrix, column, row, 0.7, rhs[:-1], rhs[-1])
        ours = np.abs(np.append(x, y) - exact).max()
        dense = np.abs(np.linalg.solve(whole, rhs) - exact).max()
        print(f"smallest eigenvalue {smallest:.0e}: error {ours:.1e}, dense {dense:.1e}")
        assert ours < 1e-12

    def test_band(self):
        """The same with a band matrix beside a zero eigenvalue."""
        value = np.linalg.eigvalsh(assembled(9)[1])[2]
        band, dense = assembled(9, value * (1.0 - 1e-11))
        rng = np.random.default_rng(1)
        column, row = rng.standard_normal((2, SIZE))
        rhs = rng.standard_normal(SIZE + 1)
        exact = np.linalg.solve(np.block([[dense, column[:, None]], [row, np.array(-1.0)]]), rhs)
        x, y = solve_bordered(band, column, row, -1.0, rhs[:-1], rhs[-1])
        np.testing.assert_allclose(np.append(x, y), exact, atol=1e-9 * np.abs(exact).max())

    @pytest.mark.parametrize("pivots", [False, True])
    def test_with_contact_coordinates(self, pivots):
        """A band matrix with a border of its own beside a zero eigenvalue; and one that needs pivots."""
        band, dense = assembled(9, np.linalg.eigvalsh(assembled(9)[1])[2] * (1.0 - 1e-11))
        if pivots:
            band.diagonal()[:] = 0.0
            np.fill_diagonal(dense, 0.0)
        rng = np.random.default_rng(2)
        columns, rows, corner = rng.standard_normal((SIZE, 2)), rng.standard_normal((2, SIZE)), np.eye(2)
        matrix, inner = Bordered(band, columns, rows, corner), np.block([[dense, columns], [rows, corner]])
        column, row, rhs = rng.standard_normal((3, SIZE + 2))
        exact = np.linalg.solve(np.block([[inner, column[:, None]], [row, np.array(2.0)]]), np.append(rhs, 0.5))
        x, y = solve_bordered(matrix, column, row, 2.0, rhs, 0.5)
        np.testing.assert_allclose(np.append(x, y), exact, atol=1e-9 * np.abs(exact).max())
        np.testing.assert_array_equal(matrix.to_sparse().toarray(), inner)

    @pytest.mark.parametrize("pivots", [False, True])
    def test_unknowns_that_only_move_with_the_last(self, pivots):
        """A gripper's: they are no unknowns of the system, and their rates are in its last column."""
        band, dense = assembled(9, 0.1)
        held, free = np.array([0, 1, 9]), np.setdiff1d(np.arange(SIZE + 2), [0, 1, 9])
        if pivots:
            band.diagonal()[free[:-2]] = 0.0
            np.fill_diagonal(dense, band.diagonal())
        rng = np.random.default_rng(3)
        columns, rows, corner = rng.standard_normal((SIZE, 2)), rng.standard_normal((2, SIZE)), np.eye(2)
        matrix, inner = Bordered(band, columns, rows, corner), np.block([[dense, columns], [rows, corner]])
        column, row, rhs, rate = rng.standard_normal((4, SIZE + 2))
        rhs[held] = rate[free] = 0.0
        last = (column + inner @ rate)[free, None]
        whole = np.block([[inner[np.ix_(free, free)], last], [row[free], np.array(2.0 + row @ rate)]])
        exact = np.linalg.solve(whole, np.append(rhs[free], 0.5))
        x, y = solve_bordered(matrix, column, row, 2.0, rhs, 0.5, held, rate)
        np.testing.assert_allclose(np.append(x[free], y), exact, atol=1e-10 * np.abs(exact).max())
        np.testing.assert_allclose(x[held], y * rate[held])


class TestEigenvalues:
    """Truth: scipy's dense solver on the free unknowns."""

    @staticmethod
    def compare(k: np.ndarray, held: np.ndarray, guess: np.ndarray | None = None) -> None:
        n = len(k)
        problem = Toy(n, lambda q, lam: (k @ q, k, np.zeros(n)))
        kept = Dense(k).with_fixed(held)
        found, mode = nearest_eigenvalues(problem.mass, kept, kept.factor(), held, guess)
        free = np.setdiff1d(np.arange(n), held)
        values = scipy.linalg.eigh(k[np.ix_(free, free)], eigvals_only=True)
        nearest = np.sort(values[np.argsort(np.abs(values))[:2]])
        np.testing.assert_allclose(found, nearest, atol=1e-7)
        assert not mode[held].any()
        np.testing.assert_allclose((k @ mode)[free], found[0] * mode[free], atol=1e-6)
        assert mode @ mode == pytest.approx(1.0, abs=1e-7)

    @pytest.mark.parametrize("n", [12, 40])
    @pytest.mark.parametrize("smallest", [(1.0, 2.0), (0.01, 3.0), (-0.035, 3.1), (-1e-7, 0.3)])
    def test_pairs_that_decide_stability(self, n, smallest):
        """Weakly stable and weakly unstable states, small ones solved densely, others by iteration."""
        k, _ = symmetric(np.r_[smallest, np.linspace(5.0, 50.0, n - 2)])
        self.compare(k, np.array([], dtype=np.intp))

    @pytest.mark.parametrize(
        "n",
        [12, 40],
    )
    def test_nearest_zero_not_lowest(self, n):
        """Several negative eigenvalues: the two nearest zero are asked for."""
        k, _ = symmetric(np.r_[-30.0, -20.0, -0.2, 0.3, np.linspace(5.0, 50.0, n - 4)], seed=3)
        self.compare(k, np.array([], dtype=np.intp))
