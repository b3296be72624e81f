"""A headless Chromium, for tests of pages. It is cut off from any network."""
from contextlib import contextmanager

from selenium import webdriver
from selenium.webdriver.chrome.service import Service

CHROMIUM, DRIVER = "/usr/bin/chromium", "/usr/bin/chromedriver"
FLAGS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=1300,900",
         "--force-device-scale-factor=1", "--host-resolver-rules=MAP * ~NOTFOUND", "--disable-background-networking")


@contextmanager
def open_page(path, profile):
    """A driver with the page open. profile: an empty folder."""
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={profile}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(service=Service(DRIVER), options=options)
    try:
        driver.set_page_load_timeout(60)
        driver.get(path.as_uri())
        yield driver
    finally:
        driver.quit()


def complaints(driver):
    """What the console has been told: warnings, errors, uncaught exceptions."""
    return [entry["message"] for entry in driver.get_log("browser")]
