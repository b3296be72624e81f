"""The report: a page that opens offline in any browser, beside it figures and tables."""
