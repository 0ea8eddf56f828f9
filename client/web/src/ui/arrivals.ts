import { h } from './dom';

/** A mesh that someone has brought. */
export interface Upload {
  bytes: Blob;
  name: string;
}

const kLeastText = 30;
const kMesh = /\.(obj|ply|off|stl|gltf|glb)$/i;

/** Makes the ways by which a mesh comes onto the page: chosen, dropped or pasted. Returns the field for files. */
export function listenForMeshes(holder: HTMLElement, open: (upload: Upload) => void): HTMLInputElement {
  const take = (files?: FileList | null): void => {
    // Materials and pictures come along with a mesh.
    const file = [...(files ?? [])].find(({ name }) => kMesh.test(name)) ?? files?.[0];
    if (file) open({ bytes: file, name: file.name });
  };
  const field = h('input', { type: 'file', hidden: true, 'aria-label': 'Mesh file', accept: '.obj,.ply,.off,.stl,.gltf,.glb' });
  field.addEventListener('change', () => {
    take(field.files);
    field.value = '';
  });
  window.addEventListener('dragover', (event) => {
    event.preventDefault();
    holder.classList.add('dropping');
  });
  window.addEventListener('dragleave', (event) => {
    if (event.relatedTarget === null) holder.classList.remove('dropping');
  });
  window.addEventListener('drop', (event) => {
    event.preventDefault();
    holder.classList.remove('dropping');
    take(event.dataTransfer?.files);
  });
  window.addEventListener('paste', (event) => {
    if (event.target instanceof HTMLInputElement || event.target instanceof HTMLTextAreaElement) return;
    const files = event.clipboardData?.files;
    const text = event.clipboardData?.getData('text/plain');
    if (files?.length) take(files);
    else if (text && text.length > kLeastText) open({ bytes: new Blob([text]), name: 'pasted' });
  });
  return field;
}
