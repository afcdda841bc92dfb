// Files that are dropped on the page, with those of folders.

const MOST_FILES = 64; // of a folder, as of a form of the service

/** Return the files that were dropped; of a folder all files in it, in the order of their names, without hidden ones. */
export async function dropped({ items }: DataTransfer): Promise<File[]> {
  // The items are there only until the event has been handled.
  const found = [...items].map((item) => item.webkitGetAsEntry() ?? item.getAsFile());
  const files: File[] = [];
  for (const one of found) {
    if (one instanceof File) files.push(one); // of another page: it is in no folder
    else if (one) await collect(one, files);
  }
  return files;
}

async function collect(entry: FileSystemEntry, files: File[]): Promise<void> {
  if (!entry.isDirectory) {
    if (files.length === MOST_FILES) throw new Error(`The folder has more than ${MOST_FILES} files. Drop the files of one map and one log.`);
    files.push(await new Promise<File>((found, failed) => (entry as FileSystemFileEntry).file(found, failed)));
    return;
  }
  const inside = (await entriesOf(entry as FileSystemDirectoryEntry)).filter(({ name }) => !name.startsWith("."));
  for (const one of inside.sort((a, b) => (a.name < b.name ? -1 : 1))) await collect(one, files);
}

async function entriesOf(folder: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = folder.createReader(), found: FileSystemEntry[] = [];
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((read, failed) => reader.readEntries(read, failed)); // 100 at most
    if (!some.length) return found;
    found.push(...some);
  }
}
