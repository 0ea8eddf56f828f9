const kName = 'creased-theme';
type Theme = 'light' | 'dark';

const preferred = (): Theme => (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');

function stored(): Theme | undefined {
  const value = localStorage.getItem(kName);
  return value === 'light' || value === 'dark' ? value : undefined;
}

export const theme = (): Theme => stored() ?? preferred();

export function applyTheme(): void {
  const own = stored();
  if (own) document.documentElement.dataset['theme'] = own;
}

/** Goes to the other theme and remembers it, unless it is what the system asks for anyway. */
export function toggleTheme(): void {
  const next: Theme = theme() === 'dark' ? 'light' : 'dark';
  localStorage.setItem(kName, next);
  document.documentElement.dataset['theme'] = next;
}

/** The colours of what is drawn on the canvas. */
export const canvasColours = () =>
  theme() === 'dark'
    ? { clay: '#c9c3b8', inside: '#6b4437', wire: '#ffffff', background: '#1c1d21' }
    : { clay: '#d8d2c6', inside: '#a0705c', wire: '#000000', background: '#f9f7f2' };
