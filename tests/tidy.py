#!/usr/bin/env python3
"""clang-tidy over sources: tests/tidy.py [--seconds N] FILE…, in the configuration of build/tidy.

Most of clang-tidy's time goes to the headers of libraries. So every source is first read alone, for the few checks that
need that and to see that it includes what it needs. Then the sources of a room, or of a folder of tests, are checked
together, in one translation unit; sources that define the same names go into different ones. Sources whose turn has not
come after --seconds are left out and named.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / 'build/tidy'
ALONE = 'misc-unused-*'  # looks at the main file only
MEANT = 'bugprone-suspicious-include'  # a group includes sources
LARGEST_GROUP = 24


class Tidy:
    def __init__(self, seconds):
        self.until = time.monotonic() + seconds
        commands = json.loads((BUILD / 'compile_commands.json').read_text())
        self.command_of = {os.path.relpath(entry['file'], ROOT): entry for entry in commands}
        self.left_out = []
        self.faulty = False

    def command(self, files, path):
        """The entry of the compilation database for `path`, which includes `files`."""
        entry = self.command_of[files[0]]
        words = entry['command'].split(' -o ')[0]
        return {'directory': entry['directory'], 'file': str(path), 'command': f'{words} -I{ROOT} -c {path}'}

    def report(self, run):
        found = '\n'.join(line for line in run.stdout.splitlines() if line)
        if run.returncode != 0:
            self.faulty = True
            print(found or run.stderr, flush=True)

    def check_alone(self, file):
        if time.monotonic() > self.until:
            self.left_out.append(file)
            return
        self.report(subprocess.run(['clang-tidy', '--quiet', '-p', BUILD, f'--checks=-*,{ALONE}', ROOT / file],
                                   capture_output=True, text=True))

    def write_group(self, name, files):
        folder = BUILD / 'together' / name
        folder.mkdir(parents=True, exist_ok=True)
        source = folder / 'all.cpp'
        source.write_text(''.join(f'#include "{ROOT / file}"\n' for file in files))
        entry = self.command(files, source)
        (folder / 'compile_commands.json').write_text(json.dumps([entry]))
        return folder, entry

    def strangers(self, name, files):
        """Those of the files that cannot be compiled together with the others."""
        _, entry = self.write_group(name, files)
        run = subprocess.run(f"{entry['command']} -fsyntax-only -w -ferror-limit=0", shell=True, capture_output=True,
                             cwd=entry['directory'], text=True)
        faults = re.findall(r'^([^\s:]+):\d+:\d+: (?:fatal )?error: ', run.stderr, re.MULTILINE)
        found = {os.path.relpath(fault, ROOT) for fault in faults}
        return [file for file in files if file in found]

    def check_together(self, name, files):
        """Returns the files that have to be in another group."""
        if time.monotonic() > self.until:
            self.left_out += [file for file in files if file not in self.left_out]
            return []
        apart = self.strangers(name, files) if len(files) > 1 else []
        if len(apart) == len(files):
            apart = files[1:]
        together = [file for file in files if file not in apart]
        folder, _ = self.write_group(name, together)
        checks = f'--checks=-{ALONE},-{MEANT}'
        self.report(subprocess.run(['clang-tidy', '--quiet', '-p', folder, checks, folder / 'all.cpp'],
                                   capture_output=True, text=True))
        return apart

    def check_room(self, name, files):
        turn = 0
        while files:
            files = self.check_together(f'{name}-{turn}', files)
            turn += 1

    def run(self, files):
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(self.check_alone, files))
            rooms = {}
            for file in files:
                # The folders of tests are binaries of their own, whose names may be the same.
                depth = 2 if file.startswith('tests/') else 1
                rooms.setdefault('-'.join(file.split('/')[:depth]), []).append(file)
            groups = [(f'{room}-{at}', of_room[at:at + LARGEST_GROUP])
                      for room, of_room in rooms.items() for at in range(0, len(of_room), LARGEST_GROUP)]
            list(pool.map(lambda group: self.check_room(*group), groups))
        if self.left_out:
            print('clang-tidy LEFT OUT for want of time, in part or whole:', *self.left_out)
        if self.faulty:
            print('clang-tidy: FAILED')
            return 1
        print(f'clang-tidy: clean ({len(files)} sources)')
        return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seconds', type=float, default=float('inf'))
    parser.add_argument('files', nargs='+')
    arguments = parser.parse_args()
    sys.exit(Tidy(arguments.seconds).run(arguments.files))


main()
