/** The limits of docs/wire.md; a decoder refuses what exceeds them. */
export const LIMITS = {
  frameBytes: 1 << 20,
  editBytes: 4 << 10,
  fields: 256,
  regionsPerField: 4096,
  probesPerField: 262_144,
  probesPerCatalog: 524_288,
  regionCells: 16,
  pageLumels: 4096,
  tileLumels: 256,
  lumelsPerField: 8 << 20,
  lumelsPerCatalog: 8 << 20,
  resourceBytes: 64 << 20,
  /** Of all that a client keeps. */
  resourceBytesInAll: 256 << 20,
  sourceBytes: 128,
  nameBytes: 64,
  snapshotEdits: 65_536,
  deltaEdits: 4096,
  layers: 3,
  fileBytes: 1 << 30,
} as const;
