/** Files of what was dropped, those in folders too. */

const MOST_FILES = 2000;

function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader();
  const found: FileSystemEntry[] = [];
  // It gives some at a time, until it gives none.
  return new Promise((resolve, reject) => {
    const next = () =>
      reader.readEntries((entries) => {
        found.push(...entries);
        if (entries.length === 0 || found.length > MOST_FILES) resolve(found);
        else next();
      }, reject);
    next();
  });
}

const fileOf = (entry: FileSystemFileEntry): Promise<File> =>
  new Promise((resolve, reject) => entry.file(resolve, reject));

const isFile = (entry: FileSystemEntry): entry is FileSystemFileEntry => entry.isFile;
const isFolder = (entry: FileSystemEntry): entry is FileSystemDirectoryEntry => entry.isDirectory;

/**
 * Return the files of a folder that may be graphs or actions, at most `most`; sources and pictures
 * are left out.
 */
async function within(folder: FileSystemDirectoryEntry, most: number): Promise<File[]> {
  const found: File[] = [];
  for (const entry of await entriesOf(folder)) {
    if (found.length >= most) break;
    if (isFolder(entry)) found.push(...(await within(entry, most - found.length)));
    else if (isFile(entry) && /(^|\.)umrf(\.graph)?\.json$/i.test(entry.name)) {
      found.push(await fileOf(entry));
    }
  }
  return found;
}

export interface Dropped {
  readonly files: readonly File[];
  readonly entries: readonly (FileSystemEntry | null)[];
}

export async function droppedFiles({ files, entries }: Dropped): Promise<File[]> {
  const folders = entries.filter((entry) => entry !== null).filter(isFolder);
  const names = new Set(folders.map(({ name }) => name));
  const plain = files.filter(({ name }) => !names.has(name));
  const inside = await Promise.all(folders.map((folder) => within(folder, MOST_FILES)));
  return [...plain, ...inside.flat()].slice(0, MOST_FILES);
}
