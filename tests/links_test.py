#!/usr/bin/env python3
"""Every link of the documentation leads somewhere.

usage: links_test.py SOURCE_DIR          links and anchors between the Markdown files of the repository, and the files they name
       links_test.py --site FOLDER       of a built site, which must also need nothing from elsewhere
"""

import html.parser
import os
import re
import sys
import urllib.parse

PASSED_BY = {"build", "node_modules", ".git", "corpus", "__pycache__"}


def files(folder, ending):
    for path, folders, names in os.walk(folder):
        folders[:] = sorted(set(folders) - PASSED_BY)
        for name in sorted(names):
            if name.endswith(ending):
                yield os.path.join(path, name)


def slug(heading):
    """The anchor of a heading, as code forges make it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def without_code(text):
    text = re.sub(r"^([ \t]*)```.*?^\1```[ \t]*$", lambda code: "\n" * code[0].count("\n"), text, flags=re.S | re.M)
    return re.sub(r"(`+)(?!`).*?(?<!`)\1(?!`)", "", text)


def anchors_of(file, known={}):
    if file not in known:
        with open(file, encoding="utf-8") as text:
            plain = re.sub(r"^([ \t]*)```.*?^\1```[ \t]*$", "", text.read(), flags=re.S | re.M)
        counts, known[file] = {}, set()
        for heading in re.findall(r"^#+ (.*)$", plain, flags=re.M):
            name = slug(heading)
            known[file].add(name if name not in counts else f"{name}-{counts[name]}")
            counts[name] = counts.get(name, 0) + 1
    return known[file]


def check_sources(source):
    found, checked = [], 0
    for file in files(source, ".md"):
        with open(file, encoding="utf-8") as text:
            content = without_code(text.read())
        for number, line in enumerate(content.splitlines(), 1):
            links = re.findall(r"\]\(([^()\s]+(?:\([^()]*\))?)\)", line) + re.findall(r"(?:src|srcset)=\"([^\"]+)\"", line)
            for link in links:
                if re.match(r"[a-z]+:", link):
                    continue
                checked += 1
                path, _, anchor = urllib.parse.unquote(link).partition("#")
                target = os.path.normpath(os.path.join(os.path.dirname(file), path)) if path else file
                where = f"{os.path.relpath(file, source)}:{number}"
                if not os.path.exists(target):
                    found.append(f"{where}: there is no {link}")
                elif anchor and target.endswith(".md") and anchor not in anchors_of(target):
                    found.append(f"{where}: {link} has no such heading")
    return found, checked


class Links(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.links, self.needed, self.ids = [], [], set()

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self.ids.update(named[key] for key in ("id", "name") if named.get(key))
        if tag in ("script", "img", "source", "iframe") and named.get("src"):
            self.needed.append(named["src"])
        elif tag == "link" and named.get("href") and named.get("rel") in ("stylesheet", "icon", "preload"):
            self.needed.append(named["href"])
        elif tag == "a" and named.get("href"):
            self.links.append(named["href"])


def check_site(site):
    found, checked, pages = [], 0, {}
    for file in files(site, ".html"):
        pages[file] = Links()
        with open(file, encoding="utf-8") as text:
            pages[file].feed(text.read())
    for file, page in pages.items():
        where = os.path.relpath(file, site)
        if where == "404.html":
            continue  # its addresses begin at the root of a server
        found += [f"{where}: needs {link} from elsewhere" for link in page.needed if re.match(r"([a-z]+:)?//", link)]
        for link in page.links + page.needed:
            if re.match(r"([a-z]+:|//)", link):
                continue
            checked += 1
            path, _, anchor = urllib.parse.unquote(link).partition("#")
            target = os.path.normpath(os.path.join(os.path.dirname(file), path.partition("?")[0])) if path else file
            if os.path.isdir(target):
                target = os.path.join(target, "index.html")
            if not os.path.exists(target):
                found.append(f"{where}: there is no {link}")
            elif anchor and target in pages and anchor not in pages[target].ids and not anchor.startswith("__"):
                found.append(f"{where}: {link} has no such anchor")
    return found, checked


def main():
    found, checked = check_site(os.path.abspath(sys.argv[2])) if sys.argv[1] == "--site" else check_sources(os.path.abspath(sys.argv[1]))
    for problem in found:
        print("✗ " + problem)
    print(f"{checked} links checked, {len(found)} lead nowhere")
    return 1 if found or not checked else 0


sys.exit(main())
