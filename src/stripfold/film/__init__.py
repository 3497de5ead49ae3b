"""Measuring lambda_c and eta_b from pictures and recordings; docs/measuring.md is the user's page."""
