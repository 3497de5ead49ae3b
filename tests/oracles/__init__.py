"""Problems with a known answer, for the tests of the solver."""
