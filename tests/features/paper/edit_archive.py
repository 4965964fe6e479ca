"""Edits an archive of `mbverify package` as a third party might who forwards it.

edit_archive.py IN OUT WORDS…, where WORDS are any of
  replace PATH OLD NEW   the first OLD in a file; PATH in the archive's folder
  scale PATH COLUMN F    the middle number of a CSV column times F
  drop PATH              leaves a file out
  add PATH               a file more
  link PATH              a link to /etc/passwd
  twice PATH             a file of that path again
  slip PATH              a file more with that path as it is
  honest                 the manifest's checksums are made to fit before what follows
"""
import hashlib
import json
import stat
import sys
import warnings
import zipfile

warnings.simplefilter('ignore')
source, target, words = sys.argv[1], sys.argv[2], sys.argv[3:]
with zipfile.ZipFile(source) as archive:
    files = {name: archive.read(name) for name in archive.namelist()}
folder = next(iter(files)).split('/')[0] + '/'
more = []


def scaled(text, column, factor):
    rows = [line.split(',') for line in text.decode().split('\n')]
    at, row = rows[0].index(column), rows[len(rows) // 2]
    row[at] = repr(float(row[at]) * factor)
    return '\n'.join(','.join(row) for row in rows).encode()


def make_honest():
    manifest = json.loads(files[folder + 'manifest.json'])
    manifest['files'] = [entry for entry in manifest['files'] if folder + entry['path'] in files]
    listed = {folder + entry['path'] for entry in manifest['files']}
    for name in files:
        if name not in listed and name != folder + 'manifest.json':
            manifest['files'].append({'path': name[len(folder):], 'role': 'result'})
    for entry in manifest['files']:
        content = files[folder + entry['path']]
        entry['bytes'], entry['sha256'] = len(content), hashlib.sha256(content).hexdigest()
    files[folder + 'manifest.json'] = json.dumps(manifest).encode()


while words:
    word = words.pop(0)
    if word == 'honest':
        make_honest()
        continue
    path = words.pop(0)
    if word == 'replace':
        old, new = words.pop(0).encode(), words.pop(0).encode()
        assert old in files[folder + path], f'{old} is not in {path}'
        files[folder + path] = files[folder + path].replace(old, new, 1)
    elif word == 'scale':
        column, factor = words.pop(0), float(words.pop(0))
        files[folder + path] = scaled(files[folder + path], column, factor)
    elif word == 'drop':
        del files[folder + path]
    elif word == 'add':
        files[folder + path] = b'more'
    elif word == 'link':
        info = zipfile.ZipInfo(folder + path)
        info.create_system, info.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
        more.append((info, b'/etc/passwd'))
    elif word == 'twice':
        more.append((zipfile.ZipInfo(folder + path), b'again'))
    elif word == 'slip':
        more.append((zipfile.ZipInfo(path), b'outside'))
    else:
        sys.exit(f'{word} is not a word of edit_archive.py')
with zipfile.ZipFile(target, 'w', zipfile.ZIP_DEFLATED) as archive:
    for name, content in files.items():
        archive.writestr(name, content)
    for info, content in more:
        archive.writestr(info, content)
