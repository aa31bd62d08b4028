// node itk.mjs FOLDER_OF_NODE_MODULES read FILE... | write FILE...
// ITK reads images and prints them as JSON, or writes a small tilted one (100 z + 10 y + x + 1) in LPS.
import path from 'node:path'

const [folder, command, ...files] = process.argv.slice(2)
const io = await import(path.join(folder, '@itk-wasm/image-io/dist/index-node.js'))

const size = [6, 5, 4]
const data = new Int16Array(120)
for (let i = 0; i < data.length; i++) data[i] = 100 * Math.floor(i / 30) + 10 * Math.floor(i % 30 / 6) + i % 6 + 1
const made = {
  imageType: { dimension: 3, componentType: 'int16', pixelType: 'Scalar', components: 1 }, name: 'made', size, data,
  origin: [6, -100, 7], spacing: [0.5, 0.75, 2], direction: new Float64Array([0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1]), metadata: new Map()
}

const found = []
for (const file of files) {
  if (command === 'write') {
    await io.writeImageNode(made, file)
  } else {
    const image = await io.readImageNode(file)
    found.push({ type: image.imageType.componentType, size: image.size, spacing: image.spacing, origin: image.origin,
      direction: Array.from(image.direction), data: Array.from(image.data, Number) })
  }
}
console.log(JSON.stringify(found))
process.exit(0)
