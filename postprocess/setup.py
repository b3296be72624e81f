"""What pyproject.toml can't say: building leaves nothing in this folder."""
import tempfile

from setuptools import setup

with tempfile.TemporaryDirectory() as scratch:
    setup(options={"build": {"build_base": scratch}, "egg_info": {"egg_base": scratch}})
