"""What the programs leave behind, checked, as arrays; and exports for others."""
from crackle.files.comparison_file import read_comparison
from crackle.files.run_file import read_run

__all__ = ["read_comparison", "read_run"]
