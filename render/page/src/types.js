/**
 * The messages of esvr-view, and the object that the page draws with.
 *
 * @typedef {[number, number, number]} Triple
 * @typedef {[number, number, number, number]} ColorPoint  value, red, green, blue (0 to 1)
 * @typedef {[number, number, number, number]} OpacityPoint  value, opacity, midpoint, sharpness
 * @typedef {{space: string, colors: ColorPoint[], opacity: OpacityPoint[]}} Transfer
 * @typedef {{eye: Triple, center: Triple, up: Triple, fov?: number, height?: number}} Camera
 *   Places in voxels. `height` in place of `fov` makes the rays parallel.
 * @typedef {{file: number, grid: number, frame: number | null}} Place
 * @typedef {Place & {show: "split" | "reference" | "difference", split: number, gain: number}} Compare
 * @typedef {{axis: "x" | "y" | "z", place: number}} Slice
 *
 * @typedef {object} Scene  All that decides a picture.
 * @property {number} file
 * @property {number} grid
 * @property {number | null} frame
 * @property {Camera} camera
 * @property {Transfer} transfer
 * @property {number} opacityLength
 * @property {number} step
 * @property {"composite" | "maximum" | "average"} mode
 * @property {"pre" | "post"} classification
 * @property {boolean} shade
 * @property {"auto" | "off"} lod
 * @property {"voxels" | "sum"} between
 * @property {Triple | null} background  null: transparent
 * @property {[Triple, Triple] | null} clip
 * @property {Slice | null} slice
 * @property {Compare | null} compare
 *
 * @typedef {{low: number, high: number, counts: number[]}} Histogram
 *
 * @typedef {[Triple, Triple, Triple]} Edges  of a voxel in the camera's space, as the library's VoxelShape
 *
 * @typedef {object} Grid
 * @property {string} name
 * @property {"ellipsoids" | "voxels" | "vdb"} kind
 * @property {string} class
 * @property {string} unit
 * @property {number} ellipsoids
 * @property {number} bytes
 * @property {number} activeVoxels
 * @property {number} background
 * @property {[Triple, Triple]} box
 * @property {Triple | null} voxelSize
 * @property {Edges | null} edges  null: a frustum, which is drawn as cubes
 * @property {[number, number]} range
 * @property {Histogram | null} histogram  null: ask for it
 * @property {Transfer} defaultLook
 *
 * @typedef {{name: string, bytes: number, frames: number[], grids: Grid[]}} FileEntry
 * @typedef {{space: string, points: ColorPoint[]}} ColorMap
 *
 * @typedef {object} Description
 * @property {string} program
 * @property {string} device
 * @property {FileEntry[]} files
 * @property {Record<string, ColorMap>} colormaps
 * @property {Record<string, OpacityPoint[]>} opacities
 * @property {string[]} [carried]  names of grids that cannot be drawn
 *
 * @typedef {object} PictureHead
 * @property {number} id
 * @property {boolean} last
 * @property {number} drawMs
 * @property {{vramBytes?: number, ellipsoids?: number, level?: number}} stats
 * @property {number | null} [psnr]  null: the pictures are equal
 * @property {number} [maxDifference]
 *
 * @typedef {object} Picture
 * @property {number} id
 * @property {boolean} last
 * @property {ImageBitmap | HTMLCanvasElement} bitmap
 * @property {PictureHead} head
 *
 * @typedef {{id: number, width: number, height: number, moving: boolean, quality: number, scene: Scene}} DrawRequest
 * @typedef {Place & {width: number, height: number, view: string, orthographic: boolean}} FitRequest
 * @typedef {{name: string, transfer: Transfer}} Preset
 * @typedef {{text: string, transfer: string | null}} Command
 *
 * @typedef {object} Backend
 * @property {Set<string>} can  What it serves beyond pictures: "command", "png", "preset", "compare",
 *   "frames", "shade", "lod", "between", "classification". Other controls are not shown.
 * @property {() => Promise<Description>} describe
 * @property {(request: DrawRequest, onPicture: (picture: Picture) => void) => Promise<void>} draw
 *   Resolves after the last picture, or when a later request replaces this one. Rejects with an Error
 *   whose message says why the scene cannot be drawn.
 * @property {(request: FitRequest) => Promise<Camera>} fit
 * @property {(place: Place) => Promise<Histogram>} histogram
 * @property {(request: {scene: Scene, width: number, height: number}) => Promise<Command>} command
 * @property {(request: {scene: Scene, width: number, height: number}) => Promise<Blob>} png
 * @property {(text: string) => Promise<Preset[]>} preset
 * @property {(listener: (open: boolean) => void) => void} onConnection  Called when the connection ends,
 *   and when there is one again.
 */
export {};
