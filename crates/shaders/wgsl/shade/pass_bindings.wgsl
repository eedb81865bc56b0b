// What a pass binds: the one group that every pass has that draws a scene.

#import shade/view

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
// Indices of the instances that the pass draws, draw by draw.
@group(0) @binding(2) var<storage, read> visible: array<u32>;
// Where the lumels of instances lie, instance by instance.
@group(0) @binding(3) var<storage, read> rectangles: array<Rectangle>;
