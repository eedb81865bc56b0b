/** `vectors/resources.json`, which Rust reads too: layouts and charts, and what they decode to. */
import { describe, expect, it } from 'vitest';

import { readCharts } from '../src/codec/charts.js';
import { layOut, readLayout } from '../src/codec/layout.js';
import { sha256 } from '../src/codec/sha256.js';
import { bytesOf, readVectors } from './support/vectors.js';

interface Vectors {
  charts: {
    bytes: string;
    hash: string;
    sizes: [number, number][];
    sources: number[];
    rectangle: number[];
    at: number[];
    triangles: number[];
  }[];
  layouts: {
    bytes: string;
    hash: string;
    page_size: number;
    pages: number;
    surfaces: {
      node: number;
      copy: number;
      primitive: number;
      back: boolean;
      charts: string;
      rectangles: [page: number, x: number, y: number][];
    }[];
  }[];
  refused: { what: 'charts' | 'layout'; name: string; bytes: string; error: string }[];
}

const vectors = readVectors<Vectors>('resources');

describe('vectors/resources.json', () => {
  it('has charts, which are named and read alike', () => {
    expect(vectors.charts.length).toBeGreaterThan(3);
    for (const { bytes, hash, sizes, sources, rectangle, at, triangles } of vectors.charts) {
      expect(sha256(bytesOf(bytes))).toBe(hash);
      expect(readCharts(bytesOf(bytes))).toEqual({
        sizes,
        sources: Uint32Array.from(sources),
        rectangle: Uint32Array.from(rectangle),
        at: Float32Array.from(at),
        triangles: Int32Array.from(triangles),
      });
    }
  });

  it('has layouts, which are named and read alike, and laid out with these charts', () => {
    const charts = new Map(vectors.charts.map(({ hash, bytes }) => [hash, readCharts(bytesOf(bytes))]));
    for (const { bytes, hash, page_size, pages, surfaces } of vectors.layouts) {
      expect(sha256(bytesOf(bytes))).toBe(hash);
      const read = readLayout(bytesOf(bytes));
      const placed = surfaces.map(({ rectangles, ...surface }) => ({
        ...surface,
        rectangles: rectangles.map(([page, x, y]) => ({ page, x, y })),
      }));
      expect(read).toEqual({ pageSize: page_size, pages, surfaces: placed });
      const laid = layOut(read, (name) => charts.get(name));
      expect(laid.surfaces.map(({ charts }) => charts)).toEqual(placed.map((own) => charts.get(own.charts)));
    }
  });

  for (const [number, { what, name, bytes, error }] of vectors.refused.entries()) {
    it(`refuses, number ${number}: ${what}, ${name}`, () => {
      const read = what === 'charts' ? readCharts : readLayout;
      expect(() => read(bytesOf(bytes))).toThrow(expect.objectContaining({ kind: error }));
    });
  }
});

describe('a layout', () => {
  const charts = (...sizes: [number, number][]) => ({
    sizes,
    sources: new Uint32Array(),
    rectangle: new Uint32Array(),
    at: new Float32Array(),
    triangles: new Int32Array(),
  });

  it('leaves out surfaces whose charts are not known, are others, or do not fit the page', () => {
    const surface = (node: number, name: string, ...rectangles: [number, number][]) => ({
      node,
      copy: 0,
      primitive: 0,
      back: false,
      charts: name,
      rectangles: rectangles.map(([x, y]) => ({ page: 0, x, y })),
    });
    const known = new Map([
      ['wide', charts([8, 4])],
      ['two', charts([1, 1], [16, 16])],
    ]);
    const resource = {
      pageSize: 16,
      pages: 1,
      surfaces: [
        surface(0, 'unknown', [0, 0]),
        surface(1, 'wide', [8, 12]),
        surface(2, 'wide', [9, 12]),
        surface(3, 'wide', [8, 13]),
        surface(4, 'wide'),
        surface(5, 'two', [15, 15], [0, 0]),
        surface(6, 'two', [15, 15]),
      ],
    };
    const { surfaces } = layOut(resource, (name) => known.get(name));
    expect(surfaces.map(({ node }) => node)).toEqual([1, 5]);
  });
});
