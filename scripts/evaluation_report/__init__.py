"""The report of an evaluation: tables, sentences and figures from the CSV files of `evaluate`."""
