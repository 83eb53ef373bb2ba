"""Lets the scripts of this folder import the modules in the package's scripts/."""
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / 'scripts'
sys.path.insert(0, str(FOLDER))
