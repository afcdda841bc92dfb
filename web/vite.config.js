// Builds the page into the package. A manifest of hashes goes along: a test without node sees when the two differ.
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig } from "vite";

const OUT = "../service/page/built";
const TYPES = "contract.ts"; // nothing of it is in the page
const sources = readdirSync("src").filter((name) => name !== TYPES);
const SOURCES = ["index.html", "package.json", "tsconfig.json", "vite.config.js", ...sources.map((name) => `src/${name}`)];

function hashes(folder, names) {
  const of = (name) => createHash("sha256").update(readFileSync(join(folder, name))).digest("hex");
  return Object.fromEntries([...names].sort().map((name) => [name, of(name)]));
}

function manifest() {
  return {
    name: "manifest",
    closeBundle() {
      const built = readdirSync(OUT).filter((name) => name !== "manifest.json");
      const text = JSON.stringify({ sources: hashes(".", SOURCES), built: hashes(OUT, built) }, null, 1);
      writeFileSync(join(OUT, "manifest.json"), `${text}\n`);
    },
  };
}

export default defineConfig({
  base: "/page/",
  build: {
    outDir: OUT,
    emptyOutDir: true,
    assetsDir: "",
    modulePreload: false,
    rollupOptions: {
      output: { entryFileNames: "page.js", assetFileNames: "page.[ext]" },
    },
  },
  plugins: [manifest()],
});
