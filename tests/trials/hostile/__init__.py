"""Classes of hostile calls. Each module holds one class and has a function `campaign(bench, count, seed)`."""
