# SPDX-License-Identifier: Apache-2.0
import pathlib
import sys
import tempfile
import unittest

import installed_links

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "deploy/debian"))
import install_documents  # noqa: E402


class Links(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-")))

    def write(self, name, text):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text)

    def mended(self, text, source):
        return install_documents.mended(text, pathlib.PurePath(source))

    def test_a_link_to_a_file_of_another_package_leads_to_its_installed_place(self):
        self.assertEqual(self.mended("[a](../proto/README.md#errors)", "docs/a.md"), "[a](../CONTRACT.md#errors)")
        self.assertEqual(self.mended("[a](../client_sdk/c/carillon.h)", "docs/a.md"),
                         "[a](../../../../include/carillon.h)")

    def test_a_link_to_a_file_of_the_source_alone_becomes_its_text(self):
        self.assertEqual(self.mended("see [the\nguide](../CONTRIBUTING.md)", "docs/a.md"), "see the\nguide")

    def test_links_to_the_web_and_code_stay(self):
        for text in ("[a](https://a.org/b)", "[a](#b)", "```js\n[a](b)\n```\n"):
            self.assertEqual(self.mended(text, "docs/a.md"), text)

    def test_no_page_of_the_packages_has_a_dead_link(self):
        """Pictures and sounds are links, too. All packages are installed into one tree."""
        packages = self.root / "packages"
        packages.mkdir()
        for package in {where.split()[0] for where in install_documents.INSTALLED.values()}:
            (packages / package).symlink_to(self.root)
            self.write(f"usr/share/doc/{package}/copyright", "")
        install_documents.install(ROOT, packages)
        pages = list((self.root / "usr/share/doc").rglob("*.md"))
        self.assertGreater(len(pages), 60)
        self.assertEqual(list(installed_links.dead_links(self.root)), [])

    def test_a_dead_link_of_an_installed_page_is_found(self):
        self.write("usr/share/doc/a/b.md", "[c](c.md#d) ![e](e.mp4)\n[web](https://a.org)\n")
        self.write("usr/share/doc/a/c.md", "[out](../../../../../etc/passwd)\n")
        self.write("usr/share/doc/a/e.mp4.gz", "")
        self.assertEqual([link.removeprefix("usr/share/doc/") for link in installed_links.dead_links(self.root)],
                         ["a/b.md: e.mp4", "a/c.md: ../../../../../etc/passwd"])


if __name__ == "__main__":
    unittest.main()
