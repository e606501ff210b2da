"""Tests in a browser, which all share one run and one Chromium: a package, so that both end with its last test."""
